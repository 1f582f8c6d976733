"""Reports of disagreements: the page on what is missing, its tables, and the study with it added."""

from experiments.report.discovery.discovery_files import results_of, write_discovery
from experiments.report.discovery.discovery_page import render_discovery
from experiments.report.discovery.discovery_verdict import verdict_line, verdict_sentence
from experiments.report.discovery.terms import Terms

__all__ = ["Terms", "render_discovery", "results_of", "verdict_line", "verdict_sentence", "write_discovery"]
