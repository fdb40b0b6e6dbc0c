"""What all designs share: counts, seed, breaks, and how conditions become the list of a participant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import wraps
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, get_args, get_origin

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from focalgradient.design.also import Also, check_also
from focalgradient.design.draws import Draws
from focalgradient.design.given_list import PARTICIPANT, listed_rows, numbered, trial_row, trials_of
from focalgradient.design.order import Place, check_label, in_order, scatter
from focalgradient.design.words import LANGUAGES
from focalgradient.errors import InputError
from focalgradient.tables import Table

__all__ = ["ASKED", "Names", "OrNone", "Phase", "Plan", "Question", "Seconds", "Trial", "no_repeats"]

Phase = Literal["practice", "main"]
"""Practice is kept in the journal, and is no part of the tables."""

Question = Literal["age", "sex", "handedness", "acuity", "correction", "eye", "chin_rest", "light"]
"""What the form can ask of a participant and of how they see the screen."""

ASKED = f"a list of some of {', '.join(get_args(Question))}"

MOST_TRIALS = 2000
"""That one participant can be asked for."""

Names = Annotated[tuple[str, ...], Field(strict=False, min_length=1)]
Seconds = Annotated[float, Field(gt=0, le=3600, description="a number of seconds above 0, like 2.5")]
OrNone = Annotated[float, Field(ge=0, le=3600, description="a number of seconds of 0 or more, like 0.5")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What every trial says of itself; those of a task add their condition.

    Parameters
    ----------
    phase, trial
        Which trial it is: each phase counts its own, from 1, in the order shown.
    repetition
        How many times this condition has been shown, this time included; 0 in practice.
    catch
        Whether it only checks that the participant attends.
    break_before
        Whether a break is offered before it.
    """

    phase: Phase = "main"
    trial: int = 0
    repetition: int = 0
    catch: bool = False
    break_before: bool = False

    @property
    def condition(self) -> tuple[Hashable, ...]:
        """What is shown, equal for repetitions of one condition: the fields that a task adds."""
        shared = {one.name for one in fields(Trial)}
        return tuple(getattr(self, one.name) for one in fields(self) if one.name not in shared)


Kind = TypeVar("Kind", bound=Trial)


def no_repeats(key: str, values: Sequence[object]) -> None:
    """Refuse what stands twice in a list of a design."""
    twice = [value for value, count in Counter(values).items() if count > 1]
    if twice:
        raise ValueError(f"{key} names {twice[0]!r} more than once: leave out the second.")


PILOT = 4
"""Trials of practice, and others, that a pilot run takes of a list that was given: our choice."""

LATER = frozenset({"also", "given_trials", "smallest_screen"})
"""Settings that came after version 0.2, whose default is empty: designs without them stay as they were recorded."""

_LAST_ORDER: dict[tuple[str, str, str | None], tuple[Any, ...]] = {}


Making = Callable[..., tuple[Any, ...]]


def _unless_given(making: Making) -> Making:
    """Return the method that lists a design's trials, or those that were given in their place."""
    if getattr(making, "unless_given", False):
        return making

    @wraps(making)
    def trials(self: Any, participant: str, session: str | None = None) -> tuple[Any, ...]:
        if not self.given_trials:
            return making(self, participant, session)
        check_label("the participant", participant)
        own = making(self.model_copy(update={"given_trials": ()}), participant, session)
        return numbered(listed_rows(self.given_trials, participant), type(own[0]), [*getattr(own[0], "factors", {})])

    trials.unless_given = True  # type: ignore[attr-defined]
    return trials


class Plan(Table):
    """Settings that all designs have."""

    task: str
    seed: Annotated[int, Field(ge=0, description="a whole number of 0 or more")] = 1987
    repetitions: Annotated[int, Field(ge=1, le=100, description="a whole number from 1 to 100")] = 1
    longest_run: Annotated[int, Field(ge=2, description="a whole number of 2 or more")] = 3
    catch_trials: Annotated[int, Field(ge=0, description="a whole number of 0 or more")] = 0
    practice_trials: Annotated[int, Field(ge=0, le=100, description="a whole number from 0 to 100")] = 0
    break_every: Annotated[int, Field(ge=0, description="a whole number of trials, or 0 for no breaks")] = 0
    least_break_s: Annotated[float, Field(ge=0, le=3600, description="a number of seconds of 0 or more")] = 0.0
    ask: Annotated[tuple[Question, ...], Field(strict=False, description=ASKED)] = ("age", "sex", "handedness")
    language: Annotated[
        str, Field(min_length=2, description="'en', 'de' or the name of a TOML file with all words")
    ] = "en"

    also: Annotated[dict[str, Also], Field(description="tables of further questions, like [also.interest]")] = Field(
        default_factory=dict
    )

    given_trials: Annotated[
        tuple[dict[str, bool | int | float | str | None], ...],
        Field(strict=False, description="a list of trials, each a table of its settings"),
    ] = ()
    """Trials that are shown in the place of those that the design would list."""

    smallest_screen: Annotated[
        tuple[Annotated[int, Field(gt=0)], ...],
        Field(strict=False, max_length=2, description="two numbers of CSS pixels, like [600, 280] for phones"),
    ] = ()
    """Of a browser's window, wider than high; touch is then enough. Without it 640 x 480 and a keyboard are needed."""

    tables: ClassVar[dict[str, type[Table]]] = {"also": Also}

    closed: ClassVar[tuple[str, ...]] = ()
    """Fields of a trial whose values in a list from elsewhere must be among those of the design's own list."""

    shortened: ClassVar[dict[str, Any]] = {}
    """What a pilot run changes."""

    @model_validator(mode="before")
    @classmethod
    def _lists(cls, data: Any) -> Any:
        """Lists of a settings file or a journal as the tuples that fields declare, however a class declares them."""
        if not isinstance(data, dict):
            return data
        tuples = {name for name, one in cls.model_fields.items() if get_origin(one.annotation) is tuple}
        return {key: tuple(one) if key in tuples and isinstance(one, list) else one for key, one in data.items()}

    @field_validator("smallest_screen")
    @classmethod
    def _sides(cls, sides: tuple[int, ...]) -> tuple[int, ...]:
        if len(sides) == 1:
            raise ValueError("smallest_screen has one number, but must have two: give width and height in CSS pixels.")
        return sides

    @field_validator("also")
    @classmethod
    def _names(cls, also: dict[str, Also]) -> dict[str, Also]:
        check_also(also)
        return also

    @model_serializer(mode="wrap")
    def _stated(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Settings as they are recorded: without what earlier versions did not have, where it is empty."""
        settings: dict[str, Any] = write(self)
        return {key: value for key, value in settings.items() if value or key not in LATER}

    @field_validator("language")
    @classmethod
    def _known(cls, language: str) -> str:
        if language not in LANGUAGES and not language.endswith(".toml"):
            raise ValueError(
                f"there are no words in {language!r}: give one of {', '.join(map(repr, LANGUAGES))} or the name of a "
                "TOML file with all words."
            )
        return language

    def check_counts(self, conditions: int) -> None:
        """Refuse numbers of trials that cannot be run."""
        trials = conditions * self.repetitions
        if trials > MOST_TRIALS:
            raise ValueError(
                f"{conditions} conditions, {self.repetitions} times each, make {trials} trials, but one participant "
                f"can be asked for {MOST_TRIALS} at most: lower repetitions or leave out conditions."
            )
        if self.catch_trials >= trials:
            raise ValueError(
                f"catch_trials is {self.catch_trials}, but must be less than the other trials, here {trials}."
            )

    @classmethod
    def __pydantic_init_subclass__(cls, **others: Any) -> None:
        """Let a list that was given take the place of the one that a class of designs makes."""
        super().__pydantic_init_subclass__(**others)
        if "trials" in vars(cls):
            cls.trials = _unless_given(cls.trials)  # type: ignore[method-assign]

    def trials(self, participant: str, session: str | None = None) -> tuple[Trial, ...]:
        """Make the list of one participant: practice first, then all else."""
        raise NotImplementedError

    def with_trials(self, name: str, rows: Sequence[Mapping[str, str]]) -> Self:
        """Return the design with a table's trials in the place of its own.

        Parameters
        ----------
        name
            Of the table, for errors.
        rows
            Cells by column: the fields of a trial, and the names of factors. A column ``participant`` says whose a row
            is; without it all participants have all rows.

        Raises
        ------
        InputError
            If a column is missing or not known, a cell is not what its column holds, or a value is none of the
            design's.
        """
        own = self.trials("01")
        kind, factors = type(own[0]), [*getattr(own[0], "factors", {})]
        checked = trials_of(name, rows, kind, factors)
        for column in (*self.closed, *factors):
            known = {trial_row(trial)[column] for trial in own}
            for number, row in enumerate(checked, start=2):
                if row[column] not in known:
                    listed = ", ".join(map(str, sorted(known)))
                    raise InputError(
                        f"{name}, row {number}: {column} is {row[column]!r}, but the design has {listed}: correct it."
                    )
        for row in checked:
            if PARTICIPANT in row:
                check_label("the participant", row[PARTICIPANT].removeprefix("sub-"))
        made = self.model_copy(update={"given_trials": tuple(checked)})
        for participant in {str(row.get(PARTICIPANT, "01")).removeprefix("sub-") for row in checked}:
            if len(made.trials(participant)) > MOST_TRIALS:
                raise InputError(
                    f"{name} has more than {MOST_TRIALS} trials of participant {participant}: leave some out."
                )
        return made

    def of(self, participant: str) -> Self:
        """Return the design as it is recorded with a participant: of a list that was given, that participant's rows."""
        if not self.given_trials:
            return self
        return self.model_copy(update={"given_trials": listed_rows(self.given_trials, participant)})

    def ordered(self, participant: str, session: str | None, conditions: Sequence[Kind]) -> tuple[Kind, ...]:
        """Put conditions, each `repetitions` times, in a participant's order, after `practice_trials` of them.

        No condition comes more than `longest_run` times in a row; the second of each two participants has the order of
        the first, mirrored.
        """
        return tuple(
            self.listed(
                participant,
                session,
                blocks=[conditions] * self.repetitions,
                factors=lambda trial: trial.condition,
                catches=lambda draws: (),
                practice=lambda draws: [
                    draws.shuffled(conditions)[number % len(conditions)] for number in range(self.practice_trials)
                ],
            )
        )

    @property
    def shown_s(self) -> float:
        """Seconds from when the stimulus of a trial appears to the question; 0 where that is not fixed."""
        return 0.0

    def least_s(self, trial: Any) -> float:
        """Return the shortest time in seconds from one answer to the next question; 0 where none is known."""
        return 0.0

    def pilot(self) -> Self:
        """Give the same design cut short, to see that everything works."""
        cut = {key: self._cut(key, to) for key, to in self.shortened.items()}
        if self.given_trials:
            first = listed_rows(self.given_trials, str(self.given_trials[0].get(PARTICIPANT, "01")))
            practice = [row for row in first if row.get("phase") == "practice"]
            cut["given_trials"] = (*practice[:PILOT], *first[len(practice) :][:PILOT])
        return self.model_validate(self.model_dump() | cut)

    def _cut(self, key: str, to: Any) -> Any:
        value = getattr(self, key)
        return value[:to] if isinstance(value, tuple) else min(value, to)

    def place(self, participant: str) -> Place:
        """Find a participant's place in the counterbalancing."""
        return Place.of(participant)

    def draws(self, participant: str, session: str | None, purpose: str) -> Draws:
        """Open the stream of draws that a participant's list takes for one purpose."""
        if session is not None:
            check_label("the session", session)
        return Draws(self.task, self.seed, session or "", self.place(participant).stream, purpose)

    def listed(
        self,
        participant: str,
        session: str | None,
        *,
        blocks: Sequence[Sequence[Kind]],
        factors: Callable[[Kind], Sequence[Hashable]],
        catches: Callable[[Draws], Sequence[Kind]],
        practice: Callable[[Draws], Sequence[Kind]],
    ) -> list[Kind]:
        """Put practice, then the conditions of the blocks with catch trials among them, in a participant's order.

        `factors` gives the levels of a trial that must not come too often in a row.
        """
        # Both of a pair have one order, and lists are made one after the other: the last order is kept.
        key = (self.model_dump_json(), self.place(participant).stream, session)
        if key not in _LAST_ORDER:
            found = in_order(blocks, factors, longest=self.longest_run, draws=self.draws(participant, session, "order"))
            _LAST_ORDER.clear()
            _LAST_ORDER[key] = tuple(found)
        order: list[Kind] = list(_LAST_ORDER[key])
        if self.place(participant).mirrored:
            order.reverse()
        # What follows must differ within a pair, whose orders are alike.
        own = self.draws(participant, session, "own, mirrored" if self.place(participant).mirrored else "own")
        trained = [
            replace(trial, phase="practice", trial=number) for number, trial in enumerate(practice(own), start=1)
        ]
        shown: Counter[Hashable] = Counter()
        main = []
        for number, trial in enumerate(scatter(catches(own), order, own), start=1):
            shown[trial.catch, trial.condition] += 1
            repetition = shown[trial.catch, trial.condition]
            pause = bool(self.break_every and number > 1 and (number - 1) % self.break_every == 0)
            main.append(replace(trial, trial=number, repetition=repetition, break_before=pause))
        return [*trained, *main]
