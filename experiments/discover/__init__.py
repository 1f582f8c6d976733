"""Where the calibrated model and measured data still disagree, and which physical effect is missing."""
