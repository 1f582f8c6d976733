"""Reports of campaigns: one self-contained page, the results as JSON, the tables as CSV."""

from experiments.report.campaign_page import render_page
from experiments.report.pictures import HeapPicture, heap_pictures
from experiments.report.writer import write_report

__all__ = ["HeapPicture", "heap_pictures", "render_page", "write_report"]
