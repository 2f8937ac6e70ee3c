// Runs a frozen diagram in WebAssembly: in a page, or in Node. It needs no DOM and no network.
"use strict";
const [DONE, ERROR, ROOM, BREAK, TERMINATED] = [0, 1, 2, 3, 4];

// Text of base64 with raw deflate inside, as bytes; and back.
const pump = async (bytes, stream) =>
  new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
const unpack = (text) =>
  pump(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)), new DecompressionStream("deflate-raw"));
const pack = async (bytes) => {
  const small = await pump(bytes, new CompressionStream("deflate-raw"));
  let text = "";
  for (let i = 0; i < small.length; i += 8192) text += String.fromCharCode(...small.subarray(i, i + 8192));
  return btoa(text);
};

class Machine {
  // about: the description; image: its memory, bytes; code: the WebAssembly module, bytes.
  static async make(about, image, code) {
    const { instance } = await WebAssembly.instantiate(code, {});
    return new Machine(about, image, instance.exports);
  }

  constructor(about, image, exports) {
    this.about = about;
    const table = exports.__indirect_function_table;
    this.functions = about.functions.map((f) => exports[f.symbol]);
    this.numbers = this.functions.map((f) => { // a function's address is its place in the table
      const place = table.grow(1);
      table.set(place, f);
      return place;
    });
    this.base = Math.ceil(exports.__heap_base.value / 64) * 64;
    const missing = this.base + image.length - exports.memory.buffer.byteLength;
    if (missing > 0) exports.memory.grow(Math.ceil(missing / 65536));
    const { buffer } = exports.memory, size = about.memory.size;
    this.bytes = new Uint8Array(buffer, this.base, image.length);
    this.ints = new BigInt64Array(buffer, this.base, size);
    this.floats = new Float64Array(buffer, this.base, size);
    this.slab = this.floats.subarray(about.memory.slab, about.memory.slab + about.memory.num_slab);
    this.image = image;
    this.samples = () => {}; // who wants what logs hold: (number of the log, rows of numbers, row length)
    this.reset();
  }

  get time() { return this.slab[0]; }

  // All as it was in the beginning.
  reset() {
    const { about, ints } = this;
    this.bytes.set(this.image);
    for (const [at, to, absolute] of about.fixups)
      ints[at] = BigInt(absolute ? this.base + to : (this.base + to) / 8);
    about.rows.forEach((f, r) => { if (f >= 0) ints[about.memory.table + r] = BigInt(this.numbers[f]); });
    this.begun = false;
    this.beginning = this.ints.slice();
  }

  // Calls a kernel of the description with some of its numbers; its status.
  call(name, numbers = {}) {
    const call = this.about.calls[name];
    for (const [parameter, value] of Object.entries(numbers))
      this.floats[call.words + call.numbers[parameter]] = value;
    return Number(this.functions[call.function](0, 0, this.base + 8 * call.words));
  }

  // Steps until time `last`, or until a step ends at or behind `pause`, or the budget of steps is used up.
  advance(last, pause = Infinity, budget = 1e6) {
    const { words } = this.about;
    if (!this.begun) this.ints[words.fresh] = 1n;
    this.begun = true;
    this.floats[words.t_break] = pause;
    this.ints[words.budget] = BigInt(budget);
    for (;;) {
      const code = this.call("advance", { T: last });
      if (code === ERROR) throw new Error(this.failure());
      if (code !== ROOM) return code;
      this.takeSamples();
    }
  }

  // As `Simulator.AdvanceTo` does.
  advanceTo(time) {
    this.begun = false;
    while (this.advance(time) === BREAK);
  }

  failure() {
    const { words, row_names } = this.about;
    const status = this.ints[words.status], name = row_names[Number(this.ints[words.row])];
    this.ints[words.status] = 0n;
    return `${name || "the integrator"} failed with status ${status} at t = ${this.time} s`;
  }

  takeSamples() {
    this.about.logs.forEach((log, k) => {
      const width = log.elements.length + 1, count = Number(this.ints[log.table + 2]);
      const start = this.about.memory.log + Number(this.ints[log.table]);
      if (count) this.samples(k, this.floats.subarray(start, start + count * width), width);
      this.ints[log.table + 2] = 0n;
    });
  }

  // The numbers of a state, input, output or group of parameters, which may be written; `changed` follows.
  vector(about) { return this.slab.subarray(about.at, about.at + about.elements.length); }

  // All states to the last bit, as hexadecimal words.
  words() {
    const { states } = this.about, at = this.about.memory.slab;
    const bits = states.flatMap((s) => [...this.ints.subarray(at + s.at, at + s.at + s.elements.length)]);
    return bits.map((word) => BigInt.asUintN(64, word).toString(16).padStart(16, "0")).join(" ");
  }

  changed() { for (let k = 0; k < 3; ++k) this.ints[this.about.words.constant + k] += 1n; }

  // Value of an output port now.
  output(about) {
    if (this.call("refresh_outputs")) throw new Error(this.failure());
    return this.vector(about);
  }

  // What differs from the beginning, as text; the same run goes on from it with the same bits.
  async save() {
    this.takeSamples();
    const found = [];
    for (let i = 0; i < this.ints.length; ++i) if (this.ints[i] !== this.beginning[i]) found.push(BigInt(i), this.ints[i]);
    return pack(new Uint8Array(BigInt64Array.from(found).buffer));
  }

  // Puts that back; refuses what is not its own and leaves all as it was.
  async load(text) {
    const bytes = await unpack(text);
    if (bytes.length % 16) throw new Error("not the state of a page");
    const pairs = new BigInt64Array(bytes.buffer);
    const kept = new Set(this.about.fixups.map(([at]) => at));
    const { table } = this.about.memory, rows = this.about.rows.length;
    for (let i = 0; i < pairs.length; i += 2) {
      const at = Number(pairs[i]);
      if (!(at >= 0 && at < this.ints.length) || kept.has(at) || (at >= table && at < table + rows))
        throw new Error("not the state of this page");
    }
    this.reset();
    for (let i = 0; i < pairs.length; i += 2) this.ints[Number(pairs[i])] = pairs[i + 1];
    this.begun = true;
  }
}

if (typeof module !== "undefined") module.exports = { Machine, unpack, pack, DONE, ERROR, ROOM, BREAK, TERMINATED };
