# SPDX-License-Identifier: BSD-3-Clause
"""Runs a program for a window, without waiting for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QObject, QProcess, QProcessEnvironment, Signal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from python_qt_binding.QtWidgets import QWidget

END_WITHIN = 40_000
"""Time that a program which is stopped has to end the processes of its hive [ms]."""


class ChildProcess(QObject):
    """One program at a time.

    Signals:
        printed: A line that it prints.
        complained: A line that it prints as an error, or as a remark for people.
        ended: It has ended: its exit code, and whether it was stopped.
        missing: There is no program of this name.
    """

    printed = Signal(str)
    complained = Signal(str)
    ended = Signal(int, bool)
    missing = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._process: QProcess | None = None
        self._stopped = False

    @property
    def is_running(self) -> bool:
        """Whether a program runs."""
        return self._process is not None

    def start(self, command: Sequence[str]) -> None:
        """Start a program, given with its words; only where none runs."""
        program, *words = command
        process = self._process = QProcess(self)
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONUNBUFFERED", "1")
        process.setProcessEnvironment(environment)
        process.readyReadStandardOutput.connect(self._read)
        process.readyReadStandardError.connect(self._read)
        process.finished.connect(self._finish)
        process.errorOccurred.connect(self._fail)
        self._stopped = False
        process.start(program, words)

    def stop(self) -> None:
        """Ask the program to end."""
        if self._process is not None:
            self._stopped = True
            self._process.terminate()

    def end(self) -> None:
        """Ask the program to end, and wait until it has."""
        if self._process is not None:
            self.stop()
            self._process.waitForFinished(END_WITHIN)

    def _read(self) -> None:
        """Pass on the lines that are complete."""
        channels = (
            (QProcess.StandardOutput, self.printed),
            (QProcess.StandardError, self.complained),
        )
        for channel, signal in channels:
            # Whoever hears of a line may ask for the end.
            while self._process is not None:
                self._process.setReadChannel(channel)
                if not self._process.canReadLine():
                    break
                signal.emit(_text(bytes(self._process.readLine())))

    def _finish(self, code: int) -> None:
        self._read()
        process, self._process = self._process, None
        if process is None:
            return
        for rest, signal in (
            (process.readAllStandardOutput(), self.printed),
            (process.readAllStandardError(), self.complained),
        ):
            if _text(bytes(rest)):
                signal.emit(_text(bytes(rest)))
        process.deleteLater()
        self.ended.emit(code, self._stopped)

    def _fail(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.FailedToStart and self._process is not None:
            process, self._process = self._process, None
            program = process.program()
            process.deleteLater()
            self.missing.emit(program)


def _text(line: bytes) -> str:
    return line.decode(errors="replace").strip()
