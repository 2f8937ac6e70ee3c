"""A headless Chromium, driven through its DevTools protocol over the websockets package that viser brings."""

import base64
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

from websockets.sync.client import connect

PATIENCE = 240  # a busy machine is no fault of the page [s]
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def until(condition, seconds=PATIENCE):
    """Waits until a function says yes."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"did not happen in {seconds} s"
        time.sleep(0.05)


def executable():
    """Returns the path of a Chromium, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


# Without a graphics card smooth edges are half of what a picture of a scene costs.
ROUGH_EDGES = """
(() => {
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return context.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
  };
})();
"""


class Chromium:
    """One browser process with pages in it; use as a context manager.

    Args:
        width: Of its pages [pixels].
        height: Of its pages [pixels].
        offline: Whether nothing of the network can be reached.
        smooth: Whether pages draw smooth edges, as people see them; tests can do without.
    """

    def __init__(self, width=800, height=500, offline=False, smooth=False):
        self._script = "" if smooth else ROUGH_EDGES
        self._profile = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        command = [
            executable(),
            "--headless=new",
            "--no-first-run",
            "--remote-debugging-port=0",
            f"--user-data-dir={self._profile.name}",
            f"--window-size={width},{height}",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--ignore-gpu-blocklist",
            "--disable-background-networking",
            "--disable-component-update",
            "--force-device-scale-factor=1",
            "--disable-dev-shm-usage",
        ]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.append("--no-sandbox")
        if offline:  # every name fails to resolve and every address is unreachable
            command += ["--host-resolver-rules=MAP * ~NOTFOUND"]
            command += ["--proxy-server=127.0.0.1:9", "--proxy-bypass-list=<-loopback>"]
        silent = subprocess.DEVNULL
        self._process = subprocess.Popen([*command, "about:blank"], stdout=silent, stderr=silent)
        self._address = f"http://127.0.0.1:{self._wait_for_port()}"
        self._pages = []

    def _wait_for_port(self):
        file = Path(self._profile.name) / "DevToolsActivePort"
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if file.exists() and file.read_text().strip():
                return int(file.read_text().split()[0])
            assert self._process.poll() is None, "chromium ended at once"
            time.sleep(0.05)
        raise TimeoutError("chromium did not start")

    def open(self, url, script="", is_shown=True):
        """Opens a page in a new tab; a script runs before the page's own, in its frames too."""
        page = Page(self._new_tab() if is_shown else self._tab_behind())
        self._pages.append(page)
        page.call("Page.enable")
        page.call("Runtime.enable")
        page.call("Network.enable")
        page.call("Page.addScriptToEvaluateOnNewDocument", source=self._script + script)
        if is_shown:
            page.call("Page.bringToFront")
        page.call("Page.navigate", url=url)
        return page

    def _new_tab(self):
        request = urllib.request.Request(f"{self._address}/json/new?about:blank", method="PUT")
        return json.load(urllib.request.urlopen(request))["webSocketDebuggerUrl"]

    def _tab_behind(self):
        """A tab that was never in front."""
        browser = Page(json.load(urllib.request.urlopen(f"{self._address}/json/version"))["webSocketDebuggerUrl"])
        number = browser.call("Target.createTarget", url="about:blank", background=True)["targetId"]
        browser.close()
        return f"{self._address.replace('http', 'ws')}/devtools/page/{number}"

    def close_pages(self):
        """Closes all tabs that open() made."""
        while self._pages:
            self.close_page(self._pages[-1])

    def close_page(self, page):
        """Closes a tab."""
        self._pages.remove(page)
        page.call("Page.close")
        page.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for page in self._pages:
            page.close()
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._profile.cleanup()


class Page:
    """One tab."""

    def __init__(self, address):
        self._socket = connect(
            address, max_size=None, ping_interval=None
        )  # nobody answers while a test does other work
        self._ids = itertools.count(1)
        self.events = []

    def call(self, method, **params):
        """Calls a DevTools method and returns its result."""
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE))
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def evaluate(self, expression):
        """Returns the value of a JavaScript expression."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", str(result)))
        return result["result"].get("value")

    def wait_for(self, expression, seconds=PATIENCE):
        """Waits until a JavaScript expression is true and returns its value."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            try:
                value = self.evaluate(expression)
            except RuntimeError:
                value = None
            if value:
                return value
            time.sleep(0.1)
        raise TimeoutError(f"the page never said yes to: {expression}")

    def wait_until_at(self, name, place, tolerance=1e-6, seconds=PATIENCE):
        """Waits until a node is drawn at a place of the scene (None: any coordinate).

        A page gets a node and its pose in two messages, and without a graphics card draws a few pictures a second:
        what it shows now is never a reason to fail, only what it does not show in the end.
        """

        def there(seen):
            return seen is not None and all(want is None or abs(s - want) <= tolerance for s, want in zip(seen, place))

        seen, deadline = None, time.monotonic() + seconds
        while not there(seen):
            assert time.monotonic() < deadline, f"{name} is at {seen}, not at {place}, after {seconds} s"
            time.sleep(0.05)
            try:
                seen = self.position(name)
            except RuntimeError:  # the page is being loaded
                seen = None

    def position(self, name):
        """Returns where a node of the scene is, in the scene's own world (+z up) [m], or None."""
        return self.evaluate(
            f"""(() => {{
              const viewer = window.__viserMutable; const node = viewer && viewer.nodeRefFromName[{json.dumps(name)}];
              if (!node) return null;
              node.updateWorldMatrix(true, false);
              const root = viewer.nodeRefFromName[""];
              root.updateWorldMatrix(true, false);
              const inverse = root.matrixWorld.clone().invert();
              const e = inverse.multiply(node.matrixWorld).elements;
              return [e[12], e[13], e[14]];
            }})()"""
        )

    def watch(self, name):
        """Notes where a node is, at every picture drawn; watched() gives the notes."""
        self.evaluate(
            f"""(() => {{
              window.__watched = [];
              const look = () => {{
                const viewer = window.__viserMutable, node = viewer && viewer.nodeRefFromName[{json.dumps(name)}];
                if (node) {{
                  node.updateWorldMatrix(true, false);
                  const root = viewer.nodeRefFromName[""];
                  const e = root.matrixWorld.clone().invert().multiply(node.matrixWorld).elements;
                  window.__watched.push([e[12], e[13], e[14]]);
                }}
                setTimeout(look, 10);
              }};
              look();
            }})()"""
        )

    def watched(self):
        """Returns the positions seen since watch()."""
        return self.evaluate("window.__watched")

    def console(self):
        """Returns what the page wrote as errors."""
        self.evaluate("0")
        errors = [e["params"] for e in self.events if e["method"] == "Runtime.exceptionThrown"]
        errors += [
            e["params"]
            for e in self.events
            if e["method"] == "Runtime.consoleAPICalled" and e["params"]["type"] == "error"
        ]
        return errors

    def requests(self):
        """Returns the addresses the page asked for."""
        self.evaluate("0")
        urls = [e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"]
        return [url for url in urls if not url.startswith(("data:", "blob:"))]

    def click(self, x, y):
        """Clicks with the left button."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def click_on(self, selector_expression, seconds=PATIENCE):
        """Clicks once on the element which a JavaScript expression returns.

        As a person does: scrolls until it is in sight, waits until it stands still with nothing in front of it, and
        tries again when the click went beside it.
        """
        look = f"""(async () => {{
          const element = {selector_expression};
          if (!element) return null;
          const quick = {{block: "nearest", inline: "nearest", behavior: "instant"}};
          element.scrollIntoView(quick);
          const box = () => {{ const r = element.getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; }};
          const before = box();
          await new Promise((drawn) => setTimeout(drawn, 100));
          const [x, y, width, height] = box();
          const middle = [x + width / 2, y + height / 2], hit = document.elementFromPoint(...middle);
          if (!width || !hit || !element.contains(hit) || before.join() !== box().join()) return null;
          window.__clicked = false;
          element.addEventListener("click", () => {{ window.__clicked = true; }}, {{once: true, capture: true}});
          return middle;
        }})()"""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.click(*self.wait_for(look, seconds))
            if self.evaluate("window.__clicked"):
                return
        raise TimeoutError(f"no click reached {selector_expression}")

    def press(self, key, code):
        """Presses and releases a key."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code)

    def screenshot(self, folder, name, width=1200, height=800):
        """Writes what the page looks like, at a size in pixels, to a PNG file in a folder; nothing if that is None."""
        if folder is None:
            return
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        time.sleep(1.5)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
        self.call("Emulation.clearDeviceMetricsOverride")

    def close(self):
        self._socket.close()
