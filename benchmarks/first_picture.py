"""The time until the site's viewer shows its first picture, from a folder and from a web server.

    make docs
    python benchmarks/first_picture.py [site] [--loads 10] [--out first_picture.csv]

Loads the page again and again in a headless Chromium without a network and without a cache. The
time runs from the start of the navigation to the frame that shows the decoded spectra. The table
has a row per way of loading: bytes of the page, and the median and the largest time.
"""

import argparse
import functools
import http.server
import json
import os
import shutil
import statistics
import subprocess
import tempfile
import threading
from pathlib import Path

from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe

PAGE = "viewer.html"
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--remote-debugging-pipe",
)
SHOWN = """new Promise((found) => {
  const look = () => {
    const shown = document.querySelector("image.tile[href]");
    if (!shown) { requestAnimationFrame(look); return; }
    const picture = new Image();
    picture.src = shown.getAttribute("href");
    picture.decode().then(() => requestAnimationFrame(() => requestAnimationFrame(() => found(performance.now()))));
  };
  look();
})"""
"""What the page is asked: the milliseconds since the start of the navigation at the first frame
with a spectrum."""


class Browser:
    """A headless Chromium with one page, which is asked through pipes.

    Protocol: https://chromedevtools.github.io/devtools-protocol/, messages that end with a zero.
    """

    def __init__(self, folder: str) -> None:
        """Start it; folder: of its profile."""
        asked, self._ask = os.pipe()
        self._hear, heard = os.pipe()

        def connect() -> None:
            """Give the new process the ends of the pipes under the numbers that it expects."""
            spare = os.dup(asked), os.dup(heard)
            os.dup2(spare[0], 3)
            os.dup2(spare[1], 4)

        command = [shutil.which("chromium") or "chromium", *FLAGS, f"--user-data-dir={folder}"]
        self._process = subprocess.Popen(
            command, preexec_fn=connect, close_fds=False, stderr=subprocess.DEVNULL
        )
        self._number = 0
        self._left = b""
        self._session = ""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        self.call("Network.enable")
        self.call("Network.setCacheDisabled", cacheDisabled=True)

    def call(self, method: str, **parameters) -> dict:
        """Return the answer to a method of the protocol."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._ask, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self._left:
                self._left += os.read(self._hear, 1 << 16)
            text, _, self._left = self._left.partition(b"\0")
            answer = json.loads(text)
            if answer.get("id") == self._number:
                return answer["result"]

    def first_picture_ms(self, address: str) -> float:
        """Return the time from the navigation to the first picture of the viewer at an address."""
        self.call("Page.navigate", url=address)
        found = self.call("Runtime.evaluate", expression=SHOWN, awaitPromise=True)
        return found["result"]["value"]

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        self._process.wait()


class Quiet(http.server.SimpleHTTPRequestHandler):
    """A server of files that prints nothing."""

    def log_message(self, *_) -> None:
        """Print nothing."""


def main() -> None:
    """Measure and write the table."""
    line = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    line.add_argument("site", nargs="?", default="site", help="folder of the built site")
    line.add_argument("--loads", type=int, default=10, help="loads in each way")
    line.add_argument("--out", default="results/benchmarks/first_picture.csv")
    options = line.parse_args()
    folder = Path(options.site).resolve()
    handler = functools.partial(Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    addresses = {
        "folder": (folder / PAGE).as_uri(),
        "web server": f"http://127.0.0.1:{server.server_port}/{PAGE}",
    }
    rows = []
    for name, address in addresses.items():
        times_ms = []
        for _ in range(options.loads):
            with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
                browser = Browser(profile)
                times_ms.append(browser.first_picture_ms(address))
                browser.close()
        rows.append(
            {
                "opened_from": name,
                "loads": options.loads,
                "page_bytes": (folder / PAGE).stat().st_size,
                "median_ms": round(statistics.median(times_ms)),
                "largest_ms": round(max(times_ms)),
                "hardware": describe(),
            }
        )
    write_csv(options.out, list(rows[0]), rows)
    print(Path(options.out).read_text())


if __name__ == "__main__":
    main()
