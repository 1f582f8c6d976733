"""Designs, one a file: functions from factors to a ``doe.Design``, and what changes or judges a design.

Space-filling points are scipy's. Of the packages on designs, pyDOE3 1.6.2 (BSD) lacks much, as the functions
say. process-improve 2.2.0 (MIT) was run against them. Its fractions, Box-Behnken runs, half-fraction
composites, definitive screening and D-optimal runs under constraints are as good as these (word lengths,
orthogonality, determinants); its Plackett-Burman columns and its blocks of Box-Behnken designs are not. Own
code keeps one ``Design`` with labels, units, blocks and notes, and spares every user of ``doe`` statsmodels
and pydantic.
"""
