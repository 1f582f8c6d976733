"""A law whose parameter has a unit that study files do not know."""

from dem_warp.parameters import Parameter

ANGER = Parameter("furlong")
