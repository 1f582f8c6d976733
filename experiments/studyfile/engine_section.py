"""``[engine]``: the program that simulates a study's cases, where it is not dem-warp itself."""

from __future__ import annotations

import shlex
from typing import Literal, Self

from pydantic import Field, field_validator, model_validator

from experiments.studyfile.schema import Section, Time


class EngineSection(Section):
    """``[engine]``: another program that simulates the cases; its folder contract is docs/engine.md."""

    name: str | None = None
    """Name of an engine that ships (liggghts, lammps, yade) or that an installed package adds."""
    command: str | None = None
    """Command of any other program, which is started in the folder of a case; no shell reads it."""
    by: Literal["hand"] | None = None
    """``"hand"``: a person simulates the cases in any program, and types in what comes out."""
    sheet: Literal["csv", "xlsx"] = "csv"
    """File of the runs by hand; ``"xlsx"``, a sheet of Excel, needs openpyxl (dem-warp[excel])."""
    approximate: bool = False
    """Take the nearest for what an engine that ships lacks, as dem-warp export --approximate does."""
    version: str = ""
    """Version of the program, in any words: results of another one are stored apart."""
    observables: tuple[str, ...] = ()
    """Observables of the test that the program or person reports with the heap; a search must have them."""
    workers: int | None = Field(default=None, ge=1)
    """Cases at once. Default: one a core."""
    time_limit: Time | None = Field(default=None, gt=0.0)
    """Wall time of one case, after which it has failed. Default: no limit."""

    @field_validator("command")
    @classmethod
    def _has_words(cls, command: str | None) -> str | None:
        if command is not None and not words_of(command):
            raise ValueError("must name a program")
        return command

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if sum(each is not None for each in (self.name, self.command, self.by)) != 1:
            raise ValueError('must have a name, a command or by = "hand", and no two of them')
        return self


def words_of(command: str) -> list[str]:
    """Split a command at blanks, except in quotes; ValueError where a quotation is not closed."""
    lexer = shlex.shlex(command, posix=True, punctuation_chars=False)
    lexer.whitespace_split, lexer.commenters, lexer.escape = True, "", ""
    try:
        return list(lexer)
    except ValueError:
        raise ValueError("must close every quotation mark that it opens") from None


def quoted(word: str) -> str:
    """Write a word so that `words_of` reads it as one."""
    mark = "'" if '"' in word else '"'
    return f"{mark}{word}{mark}"
