"""Base of all designs: numbers of trials, seed, breaks, and construction of a participant's trial list."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import wraps
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, get_args

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer

from focalgradient.design.also import Also, check_names
from focalgradient.design.draws import Draws, digest
from focalgradient.design.given_list import PARTICIPANT, listed_rows, numbered, trial_row, trials_of
from focalgradient.design.order import Place, check_label, in_order, scatter
from focalgradient.design.words import LANGUAGES, Words, load_words
from focalgradient.errors import InputError
from focalgradient.tables import Table

__all__ = [
    "Asked",
    "Breaks",
    "Count",
    "Names",
    "OrNone",
    "Phase",
    "Plan",
    "Question",
    "Repetitions",
    "Rounds",
    "Scenes",
    "Seconds",
    "Share",
    "Trial",
    "UpTo100",
    "no_repeats",
]

Phase = Literal["practice", "main"]
"""Phase of a session; practice trials are kept in the journal, but not in the tables."""

Question = Literal["age", "sex", "handedness", "acuity", "correction", "eye", "chin_rest", "light"]
"""Questions that the form can ask about participants and their viewing conditions."""

MOST_TRIALS = 2000
"""Maximum number of trials per participant."""

Names = Annotated[tuple[str, ...], Field(min_length=1)]
Scenes = Annotated[Names, Field(description="a list of names of scenes, like ['spheres-01']")]
Count = Annotated[int, Field(ge=0)]
UpTo100 = Annotated[int, Field(ge=0, le=100)]
Repetitions = Annotated[int, Field(ge=1, le=100)]
Rounds = Annotated[int, Field(ge=1, le=20)]
Breaks = Annotated[int, Field(ge=0, description="a whole number of trials, or 0 for no breaks")]
Share = Annotated[float, Field(ge=0, le=1, description="a share from 0 to 1")]
Seconds = Annotated[float, Field(gt=0, le=3600, description="a number of seconds above 0, like 2.5")]
OrNone = Annotated[float, Field(ge=0, le=3600, description="a number of seconds of 0 or more, like 0.5")]
Asked = Annotated[tuple[Question, ...], Field(description=f"a list of some of {', '.join(get_args(Question))}")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """Fields of every trial; tasks add the fields of their condition.

    Parameters
    ----------
    phase, trial
        Phase, and number of the trial within its phase, from 1, in the order shown.
    repetition
        Number of presentations of this condition so far, including this one; 0 in practice.
    catch
        Whether the trial only checks attention.
    break_before
        Whether a break is offered before the trial.
    """

    phase: Phase = "main"
    trial: int = 0
    repetition: int = 0
    catch: bool = False
    break_before: bool = False

    @property
    def condition(self) -> tuple[Hashable, ...]:
        """Condition, equal for its repetitions: the values of the fields that a task adds."""
        shared = {one.name for one in fields(Trial)}
        return tuple(getattr(self, one.name) for one in fields(self) if one.name not in shared)


Kind = TypeVar("Kind", bound=Trial)


def no_repeats(key: str, values: Sequence[object]) -> None:
    """Raise `ValueError` for duplicates in a list of a design."""
    twice = [value for value, count in Counter(values).items() if count > 1]
    if twice:
        raise ValueError(f"{key} names {twice[0]!r} more than once: leave out the second.")


PILOT = 4
"""Number of practice trials, and of main trials, that a pilot run takes from a given list (our choice)."""

RECORDED_IF_SET = frozenset({"also", "given_trials", "practice_required", "smallest_screen"})
"""Settings with an empty default, which are recorded only where they are set."""

_LAST_ORDER: dict[tuple[str, str, str | None], tuple[Any, ...]] = {}


Making = Callable[..., tuple[Any, ...]]


def _unless_given(making: Making) -> Making:
    """Wrap a design's method `trials` so that given trials replace its list."""
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
    """Settings of all designs."""

    task: str
    seed: Count = 1987
    repetitions: Repetitions = 1
    longest_run: Annotated[int, Field(ge=2)] = 3
    catch_trials: Count = 0
    practice_trials: UpTo100 = 0
    break_every: Breaks = 0
    least_break_s: Annotated[float, Field(ge=0, le=3600, description="a number of seconds of 0 or more")] = 0.0
    ask: Asked = ("age", "sex", "handedness")
    language: Annotated[
        str, Field(min_length=2, description="'en', 'de' or the name of a TOML file with all words")
    ] = "en"

    also: Annotated[dict[str, Also], Field(description="tables of further questions, like [also.interest]")] = Field(
        default_factory=dict
    )

    given_trials: Annotated[
        tuple[dict[str, bool | int | float | str | None], ...],
        Field(description="a list of trials, each a table of its settings"),
    ] = ()
    """Trials shown instead of the design's own list."""

    smallest_screen: Annotated[
        tuple[Annotated[int, Field(gt=0)], ...],
        Field(max_length=2, description="two numbers of CSS pixels, like [600, 280] for phones"),
    ] = ()
    """Minimum size of a browser window, width first; touch is then sufficient. Default: 640 x 480 and a keyboard."""

    closed: ClassVar[tuple[str, ...]] = ()
    """Fields of a trial whose values in a given list must occur in the design's own list."""

    shortened: ClassVar[dict[str, Any]] = {"repetitions": 1}
    """Settings that a pilot run reduces."""

    @field_validator("smallest_screen")
    @classmethod
    def _sides(cls, sides: tuple[int, ...]) -> tuple[int, ...]:
        if len(sides) == 1:
            raise ValueError("smallest_screen has one number, but must have two: give width and height in CSS pixels.")
        return sides

    @field_validator("also")
    @classmethod
    def _names(cls, also: dict[str, Also]) -> dict[str, Also]:
        check_names("also", also)
        return also

    @model_serializer(mode="wrap")
    def _stated(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the settings as recorded: without later settings that are empty."""
        settings: dict[str, Any] = write(self)
        return {key: value for key, value in settings.items() if value or key not in RECORDED_IF_SET}

    @field_validator("language")
    @classmethod
    def _known(cls, language: str) -> str:
        if language not in LANGUAGES and not language.endswith(".toml"):
            raise ValueError(
                f"there are no texts in {language!r}: give one of {', '.join(map(repr, LANGUAGES))} or the name of a "
                "TOML file with all texts."
            )
        return language

    def check_counts(self, conditions: int) -> None:
        """Raise `ValueError` for numbers of trials that cannot be run."""
        trials = conditions * self.repetitions
        if trials > MOST_TRIALS:
            raise ValueError(
                f"{conditions} conditions, {self.repetitions} times each, make {trials} trials, but a "
                f"participant can have at most {MOST_TRIALS}: lower repetitions or leave out conditions."
            )
        if self.catch_trials >= trials:
            raise ValueError(
                f"catch_trials is {self.catch_trials}, but must be less than the number of other trials, which is "
                f"{trials}."
            )

    @classmethod
    def __pydantic_init_subclass__(cls, **others: Any) -> None:
        """Make given trials replace the list of each class of designs."""
        super().__pydantic_init_subclass__(**others)
        if "trials" in vars(cls):
            cls.trials = _unless_given(cls.trials)  # type: ignore[method-assign]

    def trials(self, participant: str, session: str | None = None) -> tuple[Trial, ...]:
        """Return the trial list of one participant, practice first."""
        raise NotImplementedError

    def with_trials(self, name: str, rows: Sequence[Mapping[str, str]]) -> Self:
        """Return the design with a table's trials instead of its own.

        Parameters
        ----------
        name
            Name of the table, for messages.
        rows
            Cells by column: fields of a trial, and names of factors. The column ``participant`` assigns rows to
            participants; without it all participants have all rows.

        Raises
        ------
        InputError
            If a column is missing or unknown, a cell is invalid, or a value does not occur in the design.
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
                    f"{name} has more than {MOST_TRIALS} trials for participant {participant}: leave some out."
                )
        return made

    def of(self, participant: str) -> Self:
        """Return the design as recorded for a participant: with that participant's rows of given trials."""
        if not self.given_trials:
            return self
        return self.model_copy(update={"given_trials": listed_rows(self.given_trials, participant)})

    def ordered(self, participant: str, session: str | None, conditions: Sequence[Kind]) -> tuple[Kind, ...]:
        """Return conditions, each `repetitions` times, in a participant's order, preceded by `practice_trials` of them.

        No condition occurs more than `longest_run` times in a row; the second participant of each pair has the reversed
        order of the first.
        """
        return self.listed(
            participant,
            session,
            blocks=[conditions] * self.repetitions,
            factors=lambda trial: trial.condition,
            practice=lambda draws: draws.rounds(conditions, self.practice_trials),
        )

    @property
    def shown_s(self) -> float:
        """Time in s from the onset of a trial's stimulus to the question; 0 if it is not fixed."""
        return 0.0

    def words(self) -> Words:
        """Return the texts of the design's language; English ones if that is a file of texts."""
        return load_words(self.language if self.language in LANGUAGES else "en")

    def least_s(self, trial: Any) -> float:
        """Return the minimum time in s from one answer to the next question; 0 if unknown."""
        return 0.0

    def pilot(self) -> Self:
        """Return a shortened design for a test run."""
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
        """Return a participant's position in the counterbalancing."""
        return Place.of(participant)

    def draws(self, participant: str, session: str | None, purpose: str) -> Draws:
        """Return the random stream of a participant's list for one purpose."""
        if session is not None:
            check_label("the session", session)
        return Draws(self.task, self.seed, session or "", self.place(participant).stream, purpose)

    def noise_seed(self, participant: str, trial: Trial, session: str | None = None) -> int:
        """Return the seed (32 bits) of a trial's noise: it differs between participants, sessions, phases and trials.

        >>> plan = Plan(task="depthrating")
        >>> plan.noise_seed("01", Trial(phase="main", trial=1)), plan.noise_seed("01", Trial(phase="practice", trial=1))
        (2761262980, 2785432514)
        """
        return digest(self.task, self.seed, session or "", participant, trial.phase, trial.trial, "noise") % 2**32

    def listed(
        self,
        participant: str,
        session: str | None,
        *,
        blocks: Sequence[Sequence[Kind]],
        factors: Callable[[Kind], Sequence[Hashable]],
        catches: Callable[[Draws], Sequence[Kind]] = lambda draws: (),
        practice: Callable[[Draws], Sequence[Kind]] = lambda draws: (),
    ) -> tuple[Kind, ...]:
        """Return practice, then the conditions of the blocks interspersed with catch trials, in a participant's order.

        `factors` returns the levels of a trial whose runs are limited.
        """
        # Both participants of a pair share an order, and lists are made in sequence: the last order is cached.
        key = (self.model_dump_json(), self.place(participant).stream, session)
        if key not in _LAST_ORDER:
            found = in_order(blocks, factors, longest=self.longest_run, draws=self.draws(participant, session, "order"))
            _LAST_ORDER.clear()
            _LAST_ORDER[key] = tuple(found)
        order: list[Kind] = list(_LAST_ORDER[key])
        if self.place(participant).mirrored:
            order.reverse()
        # Practice and catch trials must differ within a pair, which shares an order.
        own = self.draws(participant, session, "own, mirrored" if self.place(participant).mirrored else "own")
        return self.numbered(practice(own), scatter(catches(own), order, own))

    def numbered(self, practice: Sequence[Kind], order: Sequence[Kind]) -> tuple[Kind, ...]:
        """Return practice, then the main trials in their order, with numbers, repetitions and breaks."""
        trained = [replace(trial, phase="practice", trial=number) for number, trial in enumerate(practice, start=1)]
        shown: Counter[Hashable] = Counter()
        main = []
        for number, trial in enumerate(order, start=1):
            shown[trial.catch, trial.condition] += 1
            repetition = shown[trial.catch, trial.condition]
            pause = bool(self.break_every and number > 1 and (number - 1) % self.break_every == 0)
            main.append(replace(trial, trial=number, repetition=repetition, break_before=pause))
        return (*trained, *main)
