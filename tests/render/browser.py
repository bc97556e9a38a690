"""A page that is open, without a browser: what the page of viser sends over its web socket."""

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from zoobench.render.viewer import Viewer

viser = pytest.importorskip("viser")
msgspec = pytest.importorskip("msgspec")
client = pytest.importorskip("websockets.sync.client")

_CAMERA = {"wxyz": [1, 0, 0, 0], "position": [1, 1, 1], "fov": 0.6, "near": 0.01, "far": 9.0, "look_at": [0, 0, 0]}
_PATIENCE = 20.0  # [s]


class Page:
    """A page that is open; used as a context."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._socket = client.connect(
            viewer.address.replace("http", "ws"), subprotocols=[f"viser-v{viser.__version__}"], max_size=None
        )
        threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self) -> "Page":
        self._send("ViewerCameraMessage", image_height=9, image_width=9, up_direction=[0, 1, 0], **_CAMERA)
        until(lambda: self._viewer.is_watched)
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        until(lambda: not self._viewer.is_watched)

    def set(self, handle: Any, value: object) -> None:
        """Set a slider or a checkbox, or click a button (True)."""
        self._send("GuiUpdateMessage", uuid=handle._impl.uuid, updates={"value": value})

    def press(self, key: str) -> None:
        """Press a key that stands for a command."""
        commands = self._viewer.server.gui._command_handle_from_uuid
        (uuid,) = (uuid for uuid, command in commands.items() if command.hotkey == key)
        self._send("CommandTriggerMessage", uuid=uuid)

    def _send(self, kind: str, **content: object) -> None:
        self._socket.send(msgspec.msgpack.encode({"type": kind, **content}))

    def _read(self) -> None:
        """A page that reads nothing would hold up the server."""
        for _ in self._socket:
            pass


def until(holds: Callable[[], bool]) -> None:
    """Wait until something holds; a failure where it does not."""
    end = time.monotonic() + _PATIENCE
    while not holds():
        assert time.monotonic() < end, "It did not come to that."
        time.sleep(0.01)


def node(viewer: Viewer, name: str) -> Any:
    """A part of the scene."""
    found = viewer.server.scene.get_handle_by_name(f"/world/{name}" if name else "/world")
    assert found is not None, name
    return found


def skin_centres(viewer: Viewer) -> list[Any]:
    """The middle of every piece of the robot's skin `[3]` [m]."""
    robot = [node(viewer, f"robot/{number}") for number in range(_pieces(viewer))]
    return [piece.vertices.mean(axis=0) for piece in robot]


def _pieces(viewer: Viewer) -> int:
    scene, count = viewer.server.scene, 0
    while scene.get_handle_by_name(f"/world/robot/{count}") is not None:
        count += 1
    return count
