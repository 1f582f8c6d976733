"""Published ways to criticise a model, on the same bank and the same heaps as the search.

`draw` makes the benchmark, `run_methods` lets every method answer, `record_methods` writes the record.
"""
