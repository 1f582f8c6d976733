"""The public names: each is loaded with its module when it is first used."""

from .campaign_page import render_page
from .pictures import HeapPicture, heap_pictures
from .solid import SolidHeap, verified_heap
from .writer import write_report

__all__ = [
    "HeapPicture",
    "SolidHeap",
    "heap_pictures",
    "render_page",
    "verified_heap",
    "write_report",
]
