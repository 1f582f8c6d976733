"""The maker of a bank: which engine ran it, and when."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from datetime import date

from dem_warp.provenance import engine_fingerprint
from experiments.cases import Engine
from experiments.cases.engines.key import engine_identity


def fingerprint_of(engine: Engine | None) -> str:
    """Hash of an engine: of its identity, or of dem-warp's own code where it is None."""
    if engine is None:
        return engine_fingerprint()
    text = json.dumps(engine_identity(engine), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def maker_of_today(commit: str = "", engine: Engine | None = None) -> dict[str, str]:
    """Name an engine by its fingerprint, the day, and the commit of the source, empty where unknown."""
    return {"engine": fingerprint_of(engine), "day": date.today().isoformat(), "commit": commit}


def notes_on(maker: Mapping[str, str], engine: Engine | None = None) -> list[str]:
    """Return a note where another or an unknown engine than that of fresh runs made the bank."""
    if not maker:
        return ["the bank does not say which engine made it"]
    if maker["engine"] == fingerprint_of(engine):
        return []
    commit = f" (commit {maker['commit']})" if maker.get("commit") else ""
    return [f"the bank was made on {maker['day']} by another engine{commit} than the fresh runs"]
