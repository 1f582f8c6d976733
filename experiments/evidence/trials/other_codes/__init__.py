"""A second reality for the search: another code makes the heaps, with effects that only it knows.

LIGGGHTS runs the trial study in an input of its own: its laws, filling, walls, time step and seeds.
The course of each test, the place of every sphere and the force on the tube come back over time, and the
observables are read from them by the functions that read our own heaps. All else, seals, analysis, score and
record, is that of the engine's own trials.
"""
