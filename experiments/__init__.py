"""Everything that a person runs, from the bottom up.

``studyfile`` reads what a person configures, ``cases`` simulates, stores and measures, ``calibrate`` turns
tables of angles into decisions, ``studies`` holds studies to start from, ``discover`` asks what a model
lacks, ``report`` shows both, and ``runs`` does all of it in a folder. ``api`` has it as two functions, which
the command line in ``cli`` and ``commands`` calls. ``benchmarks`` and ``trials`` are evidence and are not
installed. Each imports only what is named before it, and ``errors`` and ``files`` below them all.
"""
