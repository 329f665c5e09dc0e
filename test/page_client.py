"""A browser's side of the page without a browser: what it posts, and what its sockets carry."""

from contextlib import contextmanager
import json
import time
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

from websockets.sync.client import connect

from ros_helpers import DEADLINE


class PageClient:
    """
    Asks for actions and looks at frames; the newest of each kind is kept.

    Parameters
    ----------
    url : str
        Where the page is.

    """

    def __init__(self, url):
        parts = urlsplit(url)
        self.origin = f'{parts.scheme}://{parts.netloc}'
        self.frames = {}
        self.codes = []  #: of all advice, without repeats
        self._n_seen = 0
        self._view = None

    @contextmanager
    def looking(self):
        """Look at frames meanwhile."""
        with self._socket('view') as self._view:
            yield self

    def _socket(self, name):
        return connect(f'ws{self.origin[4:]}/{name}', origin=self.origin)

    def ask(self, action, **values):
        """Ask for an action; return what came of it."""
        request = Request(
            f'{self.origin}/api/actions/{action}', json.dumps(values).encode(),
            {'Origin': self.origin, 'Content-Type': 'application/json'})
        with urlopen(request, timeout=DEADLINE) as reply:
            return json.loads(reply.read())

    def look(self, seconds=0.05):
        """Take in what comes within a time."""
        try:
            message = self._view.recv(timeout=seconds)
        except TimeoutError:
            return
        self._n_seen += 1
        self._view.send(json.dumps({'seen': self._n_seen}))
        for frame in json.loads(message) if isinstance(message, str) else [_header(message)]:
            self._keep(frame)

    def _keep(self, frame):
        self.frames[frame['type']] = frame
        code = frame['advice']['code'] if frame['type'] == 'state' else ''
        if code and code not in self.codes[-1:]:
            self.codes.append(code)

    @property
    def state(self):
        return self.frames.get('state')

    @property
    def place(self):
        robot = self.frames['robot']
        return robot['x'], robot['y']

    def wait(self, predicate, what, deadline=DEADLINE):
        """Look until something is so."""
        until = time.monotonic() + deadline
        while not (self.state and predicate()):
            assert time.monotonic() < until, f'{what} has not come: {self.state}'
            self.look()

    def drive(self, v, w, until, what):
        """Hold the pad until something is so, then let go."""
        with self._socket('drive') as socket:
            def held():
                socket.send(json.dumps({'t': time.monotonic() * 1000.0, 'v': v, 'w': w}))
                return until()
            self.wait(held, what)
            socket.send(json.dumps({'t': time.monotonic() * 1000.0, 'v': 0, 'w': 0}))

    def presses_stop(self):
        """Press STOP, which goes through the socket to drive with."""
        with self._socket('drive') as socket:
            socket.send('{"stop":true}')
            # The socket ends behind what it carried.
            socket.close()


def _header(message):
    length = int.from_bytes(message[:4], 'little')
    return json.loads(message[4:4 + length])
