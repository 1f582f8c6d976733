"""Evidence: verification, performance, robustness, accuracy, trials and records of studies."""
