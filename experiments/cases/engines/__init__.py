"""Engines that simulate cases: dem-warp and other programs."""
