"""Parts of a flank that a line is fitted to, by name."""

from __future__ import annotations

from dataclasses import dataclass

from imaging.picture_error import PictureError


@dataclass(frozen=True)
class FitSettings:
    """Part of a flank that the line is fitted to: angles with different settings are not comparable."""

    name: str
    """Name in reports."""
    lower: float
    upper: float
    """Part of the heap's height that the fit covers, 0 to 1."""
    toe: float = 1.0
    """A flank begins where its line is this many times higher than the outline is rough (root mean square
    about the line). Lower down there are single grains that rolled away, and gaps between them that the plate
    cuts off. On a smooth flank this leaves nothing out."""

    def __post_init__(self) -> None:
        place = f"fit {self.name!r}"
        if not 0.0 <= self.lower < self.upper <= 1.0:
            raise PictureError(place, "must have 0 <= lower < upper <= 1", (self.lower, self.upper))
        if not 0.0 <= self.toe <= 5.0:
            raise PictureError(place, "must have 0 <= toe <= 5", self.toe)

    @classmethod
    def of(cls, fit: str | FitSettings) -> FitSettings:
        """Look up a named fit (see `FITS`); settings pass through."""
        if isinstance(fit, FitSettings):
            return fit
        if fit not in FITS:
            raise PictureError("fit", f"must be one of {', '.join(FITS)}, or FitSettings", repr(fit))
        return FITS[fit]


FITS = {
    settings.name: settings
    for settings in (
        FitSettings("flank", 0.0, 1.0),
        FitSettings("trimmed", 0.1, 0.9),
        FitSettings("middle", 0.2, 0.8),
        FitSettings("lower", 0.0, 0.5),
        FitSettings("upper", 0.5, 1.0),
    )
}
"""Named fits: `flank` is the whole flank from base to apex, `trimmed` its 10 to 90 % of height, `middle` its
20 to 80 %."""
