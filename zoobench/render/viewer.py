"""A page in the browser that shows a robot while it is simulated. This process serves it, by viser."""

import os
import socket
from contextlib import redirect_stdout
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError, extra
from zoobench.render.nodes import FRAME, Update, put_ground, put_medium, put_objects, put_paths, put_robot, put_water
from zoobench.render.pace import Throttle
from zoobench.render.present import LiveWorld, Present
from zoobench.render.viewpoint import camera_at
from zoobench.tasks.base import Task

if TYPE_CHECKING:
    from viser import FrameHandle, ViserServer

HOST, PORT = "127.0.0.1", 8080

_PORTS = 100  # that are tried from `PORT` on
_HOSTS = "--host 127.0.0.1 is this machine, 0.0.0.0 all of its addresses."
_EVERY = ("0.0.0.0", "::")  # hosts that stand for every address of this machine
_LIBRARIES = ("viser", "skimage.measure")
_ELEVATION, _AZIMUTH = 24.0, 60.0  # of the camera, see `camera_at` [degrees]
_ANGLE = 0.6  # of the picture's height [rad]
_ROOM = (0.36, 0.36)  # share of the picture's width and height for the robot
_BRIGHTNESS = 0.7  # of the background, by that of viser, under which grey is white
_PICTURES = 30.0  # at most [1/s]
_SETTLING = 0.15  # time constant with which the picture follows the robot [s]


class Viewer:
    """A page that shows one world at a time to everybody who opens its address; it must be closed.

    Args:
        host: the address of this machine at which it is served; 127.0.0.1 is reached from this machine alone.
        port: 0 is any free one; None is the first free one from `PORT` on.

    Attributes:
        server: of viser; its `gui` is the page's panel.

    Raises:
        UsageError: the extra `watch` is not installed, or the host or port cannot be used.
    """

    server: "ViserServer"

    def __init__(self, host: str = HOST, port: int | None = None) -> None:
        check_viewing()
        from viser import ViserServer

        self._host = host
        with redirect_stdout(None):  # it is for data
            self.server = ViserServer(host, _port(host, port), label="zoobench watch", verbose=False)
        self.server.gui.configure_theme(show_logo=False, show_share_button=False)
        self.server.scene.configure_environment_map(environment_intensity=_BRIGHTNESS)
        self._problem: Problem | None = None
        self._world: LiveWorld | None = None
        self._updates: list[Update] = []
        self._frame: FrameHandle | None = None
        self._way, self._seconds, self._pictures = np.zeros(3), 0.0, Throttle(_PICTURES)

    @property
    def address(self) -> str:
        """The address to type into a browser."""
        host = socket.gethostname() if self._host in _EVERY else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"

    @property
    def is_watched(self) -> bool:
        """Whether somebody has the page open."""
        return bool(self.server.get_clients())

    @property
    def is_due(self) -> bool:
        """Whether to show the present moment: 30 times a second, at most."""
        return self._pictures.is_due()

    @property
    def moved(self) -> float:
        """How far the robot is from where it began, along the ground [m]."""
        assert self._world is not None
        return float(np.hypot(*self._world.moved[[0, 2]]))

    def begin(self, problem: Problem, present: Present, task: Task) -> None:
        """Show the start of an episode; the page is made anew where it showed another problem.

        Args:
            problem: the cell.
            present: the world at the start.
            task: of the episode, whose target is shown.
        """
        self._world = LiveWorld(problem, present.positions, task)
        self._way, self._seconds = np.zeros(3), 0.0
        with self.server.atomic():
            if problem is not self._problem:
                self._problem = problem
                self._make(self._world)
            self.show(present)

    def show(self, present: Present) -> None:
        """Show a moment of the episode."""
        assert self._world is not None, "`begin` comes before `show`"
        assert self._frame is not None
        self._world.take(present)
        with self.server.atomic():
            for update in self._updates:
                update(self._world)
            self._frame.position = tuple(-self._followed(present.seconds))

    def close(self) -> None:
        """End the server; the page stays as it is."""
        with redirect_stdout(None):
            self.server.stop()

    def _make(self, world: LiveWorld) -> None:
        """Put everything into the scene, and the camera before the robot."""
        scene, region = self.server.scene, world.region
        scene.reset()
        scene.set_up_direction("+y")
        self._frame = scene.add_frame(FRAME, show_axes=False)
        parts = (put_ground, put_medium, put_water, put_robot, put_objects, put_paths)
        self._updates = [put(scene, region) for put in parts]
        robot = world.recording.robot[0, world.recording.solid].astype(float)
        view = camera_at(robot, _ELEVATION, _AZIMUTH, aspect=0.9, room=_ROOM, shift=(0.0, 0.0))
        camera = self.server.initial_camera
        camera.fov = _ANGLE
        camera.look_at = view.focus
        camera.position = view.focus + view.half_height / np.tan(_ANGLE / 2) * view.towards

    def _followed(self, seconds: float) -> Array:
        """How far the robot has come `[3]` [m], without its strokes, which would shake the picture."""
        assert self._world is not None
        share = 1.0 - np.exp((self._seconds - seconds) / _SETTLING)
        self._way += share * (self._world.moved - self._way)
        self._seconds = seconds
        return self._way


def check_viewing() -> None:
    """Check that this installation can show robots in a browser.

    Raises:
        UsageError: the extra `watch` is not installed.
    """
    with extra("watch", "A page to watch a robot needs"):
        for module in _LIBRARIES:
            import_module(module)


def _port(host: str, port: int | None) -> int:
    """A port that is free now; arguments and errors as of `Viewer`.

    Asked here, since viser takes another port in silence, and waits for ever where the host is none of this machine.
    """
    tried, fault = range(PORT, PORT + _PORTS) if port is None else [port], ""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        socket.getaddrinfo(host or None, 0, family)
    except (socket.gaierror, UnicodeError) as error:  # the latter of names such as `a..b`
        fault = getattr(error, "strerror", None) or "not a host name"
        raise UsageError(f"No page can be served at {host!r}: {fault}. Give another --host; {_HOSTS}") from None
    for number in tried:
        try:
            with socket.create_server((host, number), family=family) as free:
                return int(free.getsockname()[1])
        except OSError as error:
            fault = os.strerror(error.errno or 0)
    raise UsageError(
        f"No page can be served at {host!r}, port {tried[-1]}: {fault}. "
        f"Give another --port, or 0 for any free one; {_HOSTS}"
    )
