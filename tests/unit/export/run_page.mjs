// Runs the machine of a saved page in Node: node run_page.mjs PAGE TIME... ; the state as hexadecimal words, a line a time.
import fs from "fs";
import vm from "vm";
import { createRequire } from "module";

const [page, ...times] = process.argv.slice(2);
const text = fs.readFileSync(page, "utf8");
const data = (id) => JSON.parse(new RegExp(`id="${id}">(.*?)</script>`, "s").exec(text)[1]);
const source = /<script>("use strict";|\/\/ Runs a frozen diagram)[\s\S]*?<\/script>/.exec(text)[0].slice(8, -9);
const own = { exports: {} };
vm.runInThisContext(`(function (module) {${source}\n})`)(own);
const { Machine, unpack } = own.exports;
const about = data("diagram"), more = data("page");
const machine = await Machine.make(about, await unpack(more.image), await unpack(more.code));
for (const time of times) {
  machine.advanceTo(Number(time));
  console.log(machine.words());
}
machine.reset();
const steps = () => Number(machine.ints[about.words.steps]), best = [];
for (let round = 0; round < 30; ++round) {
  machine.reset();
  const begin = steps(), start = process.cpuUsage();
  machine.advanceTo(Number(times.at(-1)));
  const { user, system } = process.cpuUsage(start); // [us]
  best.push((user + system) / (steps() - begin));
  if (process.uptime() > 60) break;
}
console.error(`us/step ${Math.min(...best).toFixed(3)}`);
