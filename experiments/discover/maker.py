"""The maker of a bank: which engine ran it, and when."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date

from dem_warp.provenance import engine_fingerprint


def maker_of_today(commit: str = "") -> dict[str, str]:
    """Name this engine by its fingerprint, the day, and the commit of the source, empty where unknown."""
    return {"engine": engine_fingerprint(), "day": date.today().isoformat(), "commit": commit}


def notes_on(maker: Mapping[str, str]) -> list[str]:
    """Say that a bank comes from another engine than fresh runs, or that it does not tell."""
    if not maker:
        return ["the bank does not say which engine made it"]
    if maker["engine"] == engine_fingerprint():
        return []
    commit = f" (commit {maker['commit']})" if maker.get("commit") else ""
    return [f"the bank was made on {maker['day']} by another engine{commit} than the fresh runs"]
