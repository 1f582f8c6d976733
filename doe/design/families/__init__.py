"""Designs, one per file, and functions that change or judge a design.

Space-filling points are scipy's. pyDOE3 1.6.2 (BSD) lacks designs as the functions say. process-improve 2.2.0
(MIT) is as good in its fractions, Box-Behnken runs, half-fraction composites, definitive screening and
D-optimal runs under constraints, but not in its Plackett-Burman columns and its blocks of Box-Behnken
designs.
"""
