"""The page's own share of work, where viser has no way."""

# Without a graphics card a shadow costs a second a picture, everything else together 50 ms: no shadows then. And what
# lights the scene from all around, a picture of 1024 by 512, takes 5 s of a processor to be filtered before
# anything is shown: of 256 by 128 nobody sees the difference. viser alone asks for a picture turned over and for
# nothing else; the textures of meshes are asked for in other ways.
SPARE_SOFTWARE = """
(() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl && gl.getExtension("WEBGL_debug_renderer_info");
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  if (!/swiftshader|llvmpipe|softpipe|software|basic render/i.test(name)) return;
  setInterval(() => {
    const scene = window.__viserMutable && window.__viserMutable.scene;
    if (scene) scene.traverse((o) => { if (o.isLight && o.castShadow) o.castShadow = false; });
  }, 100);
  const whole = window.createImageBitmap, most = 256;
  window.createImageBitmap = async (...asked) => {
    const bitmap = await whole(...asked), [picture, options] = asked;
    const surrounds = picture instanceof Blob && options && JSON.stringify(options) === '{"imageOrientation":"flipY"}';
    if (!surrounds || bitmap.width <= most) return bitmap;
    const height = Math.round((most * bitmap.height) / bitmap.width);
    return whole(bitmap, { resizeWidth: most, resizeHeight: height, resizeQuality: "medium" });
  };
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
EVERY_PAGE = SPARE_SOFTWARE + GRID_BEHIND

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

# Ctrl and the left button hold a body where that is offered ("bodies": ends of paths, from Controls._send_keys()): what
# is nearest under the mouse, at the point that was hit, in its own frame. The mouse then moves in the plane through
# that point that faces the camera. A line shows the spring. The ray is cast by the meshes' own method, which asks of
# its caller no more than what it is given here.
GRAB = """
(() => {
  const own = (window.__sheldrake = window.__sheldrake || {});
  let held = null, lines = null;
  const path_of = (viewer, object) => {
    for (let o = object; o; o = o.parent)
      for (const name in viewer.nodeRefFromName) if (name && viewer.nodeRefFromName[name] === o) return name;
    return null;
  };
  const frame_of = (path) => path.replace(/\\/<object>$/, "");
  const may_be_held = (path) => (own.bodies || []).some((body) => `${path}/`.includes(`/${body}/`));
  const is_seen = (object) => { for (let o = object; o; o = o.parent) if (!o.visible) return false; return true; };
  const ray_at = (viewer, event) => {
    const box = viewer.canvas.getBoundingClientRect(), camera = viewer.camera;
    camera.updateMatrixWorld();
    const origin = camera.position.clone().setFromMatrixPosition(camera.matrixWorld);
    const x = (2 * (event.clientX - box.left)) / box.width - 1, y = 1 - (2 * (event.clientY - box.top)) / box.height;
    return { origin, direction: camera.position.clone().set(x, y, 0.5).unproject(camera).sub(origin).normalize() };
  };
  const hit_under = (viewer, ray) => {
    const hits = [], caster = { ray, camera: viewer.camera, near: 0, far: Infinity, params: {} };
    for (const name in viewer.nodeRefFromName) {
      const node = viewer.nodeRefFromName[name];
      if (!node || !name.endsWith("/<object>") || !is_seen(node)) continue;
      node.traverse((o) => {
        if (o.isMesh && o.visible && !(o.material && o.material.opacity === 0)) {
          o.updateWorldMatrix(true, false);
          o.raycast(caster, hits);
        }
      });
    }
    return hits.reduce((nearest, hit) => (!nearest || hit.distance < nearest.distance ? hit : nearest), null);
  };
  const tell = () => {
    const viewer = window.__viserMutable, root = viewer.nodeRefFromName[""];
    const target = root.worldToLocal(held.target.clone());
    own.say({ type: "mouse_drag", name: held.path, point: held.point.toArray(), drag_target: target.toArray() });
  };
  const screen = (viewer, point) => {
    const box = viewer.canvas.getBoundingClientRect(), p = point.clone().project(viewer.camera);
    return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
  };
  const draw = () => {
    if (!held) return;
    const viewer = window.__viserMutable, node = viewer.nodeRefFromName[held.path];
    if (!node) return end();
    node.updateWorldMatrix(true, false);
    const [x1, y1] = screen(viewer, node.localToWorld(held.point.clone())), [x2, y2] = screen(viewer, held.target);
    for (const line of lines.querySelectorAll("line"))
      for (const [name, value] of Object.entries({ x1, y1, x2, y2 })) line.setAttribute(name, value);
    const dot = lines.querySelector("circle");
    dot.setAttribute("cx", x1);
    dot.setAttribute("cy", y1);
    requestAnimationFrame(draw);
  };
  const end = () => {
    if (!held) return;
    held = null;
    lines.remove();
    window.__viserMutable.cameraControl.enabled = true;
    own.say({ type: "mouse_drag", name: "", drag_target: [] });
  };
  addEventListener("pointerdown", (event) => {
    const viewer = window.__viserMutable;
    if (held || !event.ctrlKey || event.button !== 0 || !(own.bodies || []).length || !viewer) return;
    const canvas = viewer.canvas;
    if (!canvas || !(canvas === event.target || canvas.parentElement.contains(event.target))) return;
    const hit = hit_under(viewer, ray_at(viewer, event)), name = hit && path_of(viewer, hit.object);
    if (!name || !may_be_held(frame_of(name))) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    const path = frame_of(name), node = viewer.nodeRefFromName[path];
    node.updateWorldMatrix(true, false);
    const normal = viewer.camera.getWorldDirection(hit.point.clone()), point = node.worldToLocal(hit.point.clone());
    held = { path, point, start: hit.point.clone(), target: hit.point.clone(), normal };
    viewer.cameraControl.enabled = false;
    lines = new DOMParser().parseFromString(
      '<svg xmlns="http://www.w3.org/2000/svg" class="sheldrake-spring" style="position:fixed;inset:0;width:100vw;' +
      'height:100vh;pointer-events:none;z-index:1000"><line stroke="#fff" stroke-width="5" stroke-opacity=".8"/>' +
      '<line stroke="#c2255c" stroke-width="2.5"/><circle r="5" fill="#c2255c" stroke="#fff" stroke-width="1.5"/>' +
      "</svg>",
      "image/svg+xml").documentElement;
    document.body.append(lines);
    tell();
    draw();
  }, true);
  addEventListener("pointermove", (event) => {
    if (!held) return;
    event.stopImmediatePropagation();
    const ray = ray_at(window.__viserMutable, event), along = ray.direction.dot(held.normal);
    if (Math.abs(along) < 1e-3) return;
    const distance = held.start.clone().sub(ray.origin).dot(held.normal) / along;
    held.target = ray.origin.clone().addScaledVector(ray.direction, distance);
    if (!held.due) {
      held.due = true;
      requestAnimationFrame(() => { if (held) { held.due = false; tell(); } });
    }
  }, true);
  addEventListener("contextmenu", (event) => { if (held) event.preventDefault(); }, true);
  for (const name of ["pointerup", "pointercancel", "blur"]) addEventListener(name, end, true);
  addEventListener("keydown", (event) => { if (held && event.key === "Escape") end(); }, true);
})();
"""

# Keys of any name, gamepads, that something is drawn now, and that this page's camera is to be reported. They are told
# through a text field that nobody sees, "the channel"; Controls._send_keys() says which it is and which keys count.
LIVE_PAGE = (
    EVERY_PAGE
    + KEEP_UP
    + GRAB
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
  own.say = say;
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
