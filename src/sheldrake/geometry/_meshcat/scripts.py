"""The page's own share of work, where viser has no way."""

# Without a graphics card a shadow costs a second a picture, everything else together 50 ms: no shadows then.
NO_SHADOWS_IN_SOFTWARE = """
(() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl && gl.getExtension("WEBGL_debug_renderer_info");
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  if (!/swiftshader|llvmpipe|softpipe|software|basic render/i.test(name)) return;
  setInterval(() => {
    const scene = window.__viserMutable && window.__viserMutable.scene;
    if (scene) scene.traverse((o) => { if (o.isLight && o.castShadow) o.castShadow = false; });
  }, 100);
})();
"""

# The grid gives way to what lies in its plane: it is drawn before all else that is transparent, hides nothing behind
# it, and its depth is that of a grid 5 % farther away. Moved straight away from the camera it looks the same.
GRID_BEHIND = """
(() => {
  const place = "gl_Position = projectionMatrix * viewMatrix * worldPosition;";
  const farther = "vec4 farther = viewMatrix * worldPosition; farther.xyz *= 1.05;"
    + " gl_Position = projectionMatrix * farther;";
  setInterval(() => {
    const grid = window.__viserMutable && window.__viserMutable.nodeRefFromName["/Grid"];
    if (grid) grid.traverse((o) => {
      if (!o.material || !o.material.depthWrite) return;
      o.renderOrder = -1;
      o.material.depthWrite = false;
      if (o.material.vertexShader) o.material.vertexShader = o.material.vertexShader.replace(place, farther);
      o.material.needsUpdate = true;
    });
  }, 200);
})();
"""
EVERY_PAGE = NO_SHADOWS_IN_SOFTWARE + GRID_BEHIND

# A page that does not draw still gets messages. viser's applies them at once where the tab is hidden. In a frame out of
# sight, as of a notebook scrolled away, it would keep them for the next picture, and in a tab that was never shown for
# the first: too many are applied at once here; where nothing can be applied yet they are dropped, and the first picture
# begins with the whole scene anew ("retry" connects the page's worker again).
KEEP_UP = """
(() => {
  const own = (window.__sheldrake = window.__sheldrake || { channel: null, keys: [] });
  const most = own.most || 20000, mostBytes = 64e6;
  let worker = null, bytes = 0, dropped = false;
  const post = Worker.prototype.postMessage;
  Worker.prototype.postMessage = function (message, ...rest) {
    if (message && message.type === "set_server") worker = this;
    return post.call(this, message, ...rest);
  };
  const size = (message) => Object.values(message.props || {}).reduce((n, v) => n + ((v && v.byteLength) || 0), 0);
  const watch = (viewer) => {
    const queue = viewer.messageQueue;
    queue.push = (message) => {
      if (!queue.length) bytes = 0;
      bytes += size(message);
      if (dropped || queue.length >= most || bytes > mostBytes) {
        if (!viewer.drainMessageQueue) {
          queue.length = 0;
          dropped = true;
          return 0;
        }
        if (!dropped && viewer.getRenderRequestState === "ready") viewer.drainMessageQueue();
      }
      return Array.prototype.push.call(queue, message);
    };
  };
  let watched = null;
  setInterval(() => {
    const viewer = window.__viserMutable;
    if (viewer && watched !== viewer.messageQueue) watch(viewer, (watched = viewer.messageQueue));
    if (dropped && viewer.drainMessageQueue) {
      dropped = false;
      worker.postMessage({ type: "retry" });
    }
  }, 200);
})();
"""

# Keys of any name, gamepads, that something is drawn now, and that this page's camera is to be reported. They are told
# through a text field that nobody sees, "the channel"; Controls._send_keys() says which it is and which keys count.
LIVE_PAGE = (
    EVERY_PAGE
    + KEEP_UP
    + """
(() => {
  const own = (window.__sheldrake = window.__sheldrake || { channel: null, keys: [] });
  let count = 0;
  const say = (what) => {
    const viewer = window.__viserMutable;
    if (!own.channel || !viewer) return false;
    what.count = ++count;
    viewer.sendMessage({ type: "GuiUpdateMessage", uuid: own.channel, updates: { value: JSON.stringify(what) } });
    return true;
  };
  const typing = (e) => ["INPUT", "TEXTAREA", "SELECT"].includes(e.target && e.target.tagName) &&
    e.target.type !== "range";
  addEventListener("keydown", (e) => {
    if (!typing(e) && own.keys.includes(e.code)) { say({ type: "key", code: e.code }); e.preventDefault(); }
  });
  let last = "";
  setInterval(() => {
    const pad = [...(navigator.getGamepads ? navigator.getGamepads() : [])].find((p) => p);
    if (!pad) return;
    const state = { index: pad.index, button_values: pad.buttons.map((b) => b.value), axes: [...pad.axes] };
    const text = JSON.stringify(state);
    if (text !== last && say({ type: "gamepad", gamepad: state })) last = text;
  }, 33);
  const shown = setInterval(() => {
    const viewer = window.__viserMutable, nodes = (viewer && viewer.nodeRefFromName) || {};
    if (!Object.keys(nodes).some((name) => nodes[name] && name.endsWith("/<object>"))) return;
    clearInterval(shown);
    requestAnimationFrame(() => requestAnimationFrame(() => {
      const told = setInterval(() => { if (say({ type: "shown" })) clearInterval(told); }, 50);
    }));
  }, 100);
  if (new URLSearchParams(location.search).get("tracked_camera") === "on") {
    const announce = setInterval(() => { if (say({ type: "tracked_camera" })) clearInterval(announce); }, 250);
  }
})();
"""
)
