"""Response surfaces: fits, contours, regions and optima."""
