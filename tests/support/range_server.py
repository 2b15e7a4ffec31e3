"""A web server of a folder that sends byte ranges, as object stores and nginx do, and Python's own
does not.
"""

import contextlib
import functools
import re
import sys
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path


class Ranges(SimpleHTTPRequestHandler):
    """Answers a request for a range with these bytes, and counts connections and the bytes it sends
    by file.
    """

    protocol_version = "HTTP/1.1"
    # An answer would otherwise wait for the receipt of its headers.
    wbufsize = 1 << 16

    def setup(self) -> None:
        """Count a new connection."""
        self.server.connections += 1
        super().setup()

    def do_GET(self) -> None:
        """Send a range of a file, or what the server's `answers` say for its name: headers and a
        status.
        """
        path = Path(self.translate_path(self.path))
        status, headers = self.server.answers.get(path.name, (206 if path.is_file() else 404, {}))
        data = path.read_bytes() if status == 200 else b""
        if status == 206:
            first, last = map(
                int, re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"]).groups()
            )
            with path.open("rb") as file:
                file.seek(first)
                data = file.read(last - first + 1)
        self.send_response(status)
        for name, value in {**headers, "Content-Length": str(len(data))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)
        self.server.sent[path.name] = self.server.sent.get(path.name, 0) + len(data)

    def log_message(self, *words: object) -> None:
        """Keep quiet."""


@contextlib.contextmanager
def serving(folder: Path, answers: dict | None = None) -> Iterator[ThreadingHTTPServer]:
    """A running server of a folder; `.address` is that of the folder, `.sent` the bytes it has sent
    by file.
    """
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Ranges, directory=str(folder)))
    server.daemon_threads = True
    server.answers = answers or {}
    server.sent = {}
    server.connections = 0
    server.address = f"http://127.0.0.1:{server.server_port}"
    # The server looks for the end this often (s), and each test waits for its end.
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


if __name__ == "__main__":
    # python range_server.py FOLDER: print the folder's address, and serve until this process is
    # ended.
    with serving(Path(sys.argv[1])) as running:
        print(running.address, flush=True)
        threading.Event().wait()
