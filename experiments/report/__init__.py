"""Reports of campaigns: one self-contained page, the results as JSON, the tables as CSV."""

from experiments.report.campaign_page import render_page
from experiments.report.pictures import HeapPicture, heap_pictures
from experiments.report.solid import SolidHeap, verified_heap
from experiments.report.writer import write_report

__all__ = ["HeapPicture", "SolidHeap", "heap_pictures", "render_page", "verified_heap", "write_report"]
