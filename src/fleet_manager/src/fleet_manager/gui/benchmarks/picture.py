# SPDX-License-Identifier: BSD-3-Clause
"""Shows a picture from a file as wide as there is room."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QSize, Qt
from python_qt_binding.QtGui import QImage, QImageReader, QPixmap
from python_qt_binding.QtWidgets import QLabel, QScrollArea

from fleet_manager.gui.benchmarks.background import Background

if TYPE_CHECKING:
    from concurrent.futures import Future

    from python_qt_binding.QtGui import QResizeEvent, QShowEvent

NARROWEST = 320  # [px]
MARGIN = 8  # beside the picture [px]


class Picture(QScrollArea):
    """A picture, which keeps its shape and is never wider than its file.

    Reading and scaling a large picture takes a good part of a second, so a thread does it. A
    picture is read only while there is somebody to see it.
    """

    def __init__(self) -> None:
        # Where the bar came and went, the width would depend on the height, and that on the width.
        super().__init__(widgetResizable=True, verticalScrollBarPolicy=Qt.ScrollBarAlwaysOn)
        self.label = QLabel(alignment=Qt.AlignTop | Qt.AlignLeft)
        self.setWidget(self.label)
        self._path = ""
        self._shown = ("", 0)
        self._background = Background(self)

    def show_file(self, path: str) -> None:
        """Show the picture in a file; no path, no picture."""
        self._path, self._shown = path, ("", 0)
        self._background.forget()
        if not path:
            self.label.clear()
        self._refresh()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  (Qt's name)
        """Follow the width."""
        super().resizeEvent(event)
        self._refresh()

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802  (Qt's name)
        """Catch up with what was chosen while nobody could see it."""
        super().showEvent(event)
        self._refresh()

    def _refresh(self) -> None:
        """Read the picture at the present width, unless it is shown or under way already."""
        path, width = self._path, max(self.viewport().width() - MARGIN, NARROWEST)
        if not self.isVisible() or (path, width) == self._shown:
            return
        self._shown = (path, width)
        self._background.forget()
        if path:
            self._background.do(lambda: read_picture(path, width), self._show)

    def _show(self, read: Future[QImage]) -> None:
        image = read.result()
        if image.isNull():
            self.label.setText(f"{self._path} cannot be read; run the experiment again")
        else:
            self.label.setPixmap(QPixmap.fromImage(image))


def read_picture(path: str, width: int) -> QImage:
    """Return a picture that is at most so wide [px]; a null image where it cannot be read."""
    reader = QImageReader(path)
    size = reader.size()
    if size.width() > width:
        reader.setScaledSize(QSize(width, max(1, round(size.height() * width / size.width()))))
    return reader.read()
