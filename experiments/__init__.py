"""What a person runs, from the bottom up.

``calibrate`` turns tables of angles into decisions, ``study`` reads what a person configures, ``cases``
simulates, stores and measures, ``studies`` holds studies to start from, ``report`` shows a campaign, and
``commands`` is what the command line in ``cli`` calls; ``benchmarks`` measures the speed. Each imports only
what is named before it, and ``errors`` and ``files`` below them all.
"""
