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

# Keys of any name, gamepads, and saying that this page's camera is to be reported. They are told through a
# text field that nobody sees, "the channel"; Controls._send_keys() says which it is and which keys count.
LIVE_PAGE = (
    NO_SHADOWS_IN_SOFTWARE
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
  if (new URLSearchParams(location.search).get("tracked_camera") === "on") {
    const announce = setInterval(() => { if (say({ type: "tracked_camera" })) clearInterval(announce); }, 250);
  }
})();
"""
)
