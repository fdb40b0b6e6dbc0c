"""Which test executes which line: contexts of coverage; what fixtures and caches make once counts for every user."""

from __future__ import annotations

import functools
import json
import multiprocessing.process
import subprocess
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import coverage
import pytest


class Executed:
    """Plugin of pytest that measures what each test executes of a folder.

    A context is a test, a fixture of a wider scope than a function, or a function whose results are cached. A test
    executes what its own context does and what the fixtures and cached functions do that it uses, directly or not.
    """

    def __init__(self, folder: Path) -> None:
        self.coverage = coverage.Coverage(data_file=None, config_file=False, source=[str(folder)])
        self.contexts = [""]
        self.uses: dict[str, set[str]] = defaultdict(set)
        self.seconds: dict[str, float] = defaultdict(float)
        self.failed: set[str] = set()
        self.starts_processes: set[str] = set()
        functools.lru_cache = self._noting_cache(functools.lru_cache)
        functools.cache = lambda function: functools.lru_cache(maxsize=None)(function)
        self._note_start(subprocess.Popen, "__init__")
        self._note_start(multiprocessing.process.BaseProcess, "start")
        self.coverage.start()

    @contextmanager
    def context(self, name: str) -> Iterator[None]:
        """Count what is executed here for that context, and use of it for the present one."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        self.uses[self.contexts[-1]].add(name)
        self.contexts.append(name)
        self.coverage.switch_context(name)
        try:
            yield
        finally:
            self.contexts.pop()
            self.coverage.switch_context(self.contexts[-1])

    def _noting_cache(self, original: Callable[..., Any]) -> Callable[..., Any]:
        """`functools.lru_cache` that notes who calls a function cached, and what filling its cache executes."""

        def lru_cache(maxsize: Any = 128, typed: bool = False) -> Any:
            if callable(maxsize):
                return lru_cache()(maxsize)

            def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
                name = f"cache {function.__module__}.{function.__qualname__}"

                @functools.wraps(function)
                def fill(*given: Any, **named: Any) -> Any:
                    with self.context(name):
                        return function(*given, **named)

                filled = original(maxsize, typed)(fill)

                @functools.wraps(function)
                def call(*given: Any, **named: Any) -> Any:
                    self.uses[self.contexts[-1]].add(name)
                    return filled(*given, **named)

                call.cache_clear, call.cache_info = filled.cache_clear, filled.cache_info  # type: ignore[attr-defined]
                return call

            return decorate

        return lru_cache

    def _note_start(self, kind: type, method: str) -> None:
        """Note which contexts start processes that run Python, whose lines are not measured."""
        start = getattr(kind, method)

        def noted(process: Any, *given: Any, **options: Any) -> Any:
            command = str(given[:1]) + str(options.get("args"))
            if method == "start" or sys.executable in command or "focalgradient" in command:
                self.starts_processes.add(self.contexts[-1])
            return start(process, *given, **options)

        setattr(kind, method, noted)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Know which test runs, and its fixtures."""
        fixtures = item._fixtureinfo.name2fixturedefs if hasattr(item, "_fixtureinfo") else {}
        for name, definitions in fixtures.items():
            self.uses[item.nodeid].update(f"fixture {made.baseid} {name}" for made in definitions)
        with self.context(item.nodeid):
            return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        """Measure what a fixture executes that is made for several tests."""
        if fixturedef.scope == "function":
            return (yield)
        with self.context(f"fixture {fixturedef.baseid} {fixturedef.argname}"):
            return (yield)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up the seconds of a test, and know whether it failed."""
        self.seconds[report.nodeid] += report.duration
        if report.failed:
            self.failed.add(report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Stop where a file cannot be collected."""
        if report.failed:
            raise SystemExit(str(report.longrepr))

    def save(self, to: Path, root: Path) -> None:
        """Write for each test its seconds, its lines by file, and whether it starts processes; and modules loaded."""
        self.coverage.stop()
        data = self.coverage.get_data()
        lines: dict[str, dict[str, set[int]]] = defaultdict(lambda: defaultdict(set))
        for file in data.measured_files():
            for line, contexts in data.contexts_by_lineno(file).items():
                for context in contexts:
                    lines[context][Path(file).relative_to(root).as_posix()].add(line)
        tests = {}
        for test in self.seconds.keys() - self.failed:
            used, left = {test}, [test]
            while left:
                new = self.uses.get(left.pop(), set()) - used
                used |= new
                left += new
            executed: dict[str, set[int]] = defaultdict(set)
            for context in used & lines.keys():
                for file, numbers in lines[context].items():
                    executed[file] |= numbers
            tests[test] = {
                "seconds": round(self.seconds[test], 3),
                "lines": {file: sorted(numbers) for file, numbers in executed.items()},
                "starts_processes": bool(used & self.starts_processes),
            }
        modules = [
            name
            for name, module in list(sys.modules.items())
            if (origin := getattr(module, "__file__", None)) and not Path(origin).is_relative_to(root)
        ]
        said = {"tests": tests, "failed": sorted(self.failed), "modules": modules}
        to.write_text(json.dumps(said), encoding="utf-8")


class Chosen:
    """Plugin of pytest that runs the tests of a list, in its order, and writes the first that fails into a file."""

    def __init__(self, tests: list[str], to: Path) -> None:
        self.place = {test: number for number, test in enumerate(tests)}
        self.to = to

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Keep the tests of the list."""
        items[:] = sorted(
            (item for item in items if item.nodeid in self.place), key=lambda item: self.place[item.nodeid]
        )

    def pytest_runtest_logreport(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        """Write the first that fails."""
        if report.failed and not self.to.exists():
            self.to.write_text(report.nodeid, encoding="utf-8")

    pytest_collectreport = pytest_runtest_logreport
