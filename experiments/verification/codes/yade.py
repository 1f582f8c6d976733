"""Contacts in Yade, by its own interpreter."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from dem_warp import ContactLaws
from experiments.errors import InputError
from experiments.export import Contact, Term
from experiments.export.yade import contact_terms, material_terms, rolling_terms
from experiments.verification.codes.contact_cases import CASES
from experiments.verification.codes.driver import OUTPUT, CodeRun, case_numbers, read_run, write_cases

PROGRAM = "yade_contacts.txt"


def run_yade(laws: ContactLaws, folder: Path) -> CodeRun:
    """Run all cases in a folder.

    Raises
    ------
    InputError
        When Yade is not installed.
    RuntimeError
        When it stops with an error.
    """
    if not (yade := shutil.which("yade")):
        raise InputError("Yade must be installed (Debian package yade)", "none", "PATH")
    write_cases(folder, PROGRAM, [case_numbers(case, laws, material_terms, _terms) for case in CASES])
    with (folder / "screen.log").open("w", encoding="utf-8") as screen:
        command = [yade, "-n", "-x", "-j1", "contacts.py"]
        done = subprocess.run(command, cwd=folder, stdout=screen, stderr=subprocess.STDOUT)
    if done.returncode:
        raise RuntimeError(f"yade failed in {folder}: {done.returncode}; screen.log says why")
    return read_run(folder / OUTPUT)


def _terms(contact: Contact) -> tuple[Term, ...]:
    return contact_terms(contact) + rolling_terms(contact)
