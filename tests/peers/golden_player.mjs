// A player of Facial Animation Tables, written from docs/golden.md alone.
//
//     node golden_player.mjs source.wrl.gz every_fap.fap ids.json frames.f32
//
// ids.json: numbers of the vertices to write. frames.f32: 32-bit floats, the neutral face first, then every frame.
import fs from "fs";
import zlib from "zlib";

const [faceFile, streamFile, idsFile, outFile] = process.argv.slice(2);

// The nodes of a VRML97 file: { type, fields }; USE gives the node itself.
function readNodes(text) {
  const words = [...text.matchAll(/#[^\n]*|"(?:\\.|[^"\\])*"|[[\]{}]|[^\s,[\]{}"#]+/g)]
    .map((match) => match[0])
    .filter((word) => word[0] !== "#");
  const named = {};
  const isNumber = (word) => /^[-+.\d]/.test(word);
  let at = 0;
  function skip(open, close) {
    let depth = 0;
    do {
      if (words[at] === open) depth++;
      if (words[at] === close) depth--;
      at++;
    } while (depth);
  }
  function node() {
    const word = words[at++];
    if (word === "PROTO") {
      at++;
      skip("[", "]");
      skip("{", "}");
      return null;
    }
    if (word === "USE") return named[words[at++]];
    if (word === "DEF") {
      const name = words[at++];
      return (named[name] = node());
    }
    const fields = {};
    for (at++; words[at] !== "}"; ) {
      const name = words[at++];
      fields[name] = value();
    }
    at++;
    return { type: word, fields };
  }
  function value() {
    const out = [];
    if (words[at] === "[") {
      for (at++; words[at] !== "]"; ) out.push(item());
      at++;
      return out;
    }
    if (!isNumber(words[at])) return item();
    while (isNumber(words[at])) out.push(Number(words[at++]));
    return out;
  }
  function item() {
    const word = words[at];
    if (isNumber(word)) return Number(words[at++]);
    if (word[0] === '"' || ["TRUE", "FALSE", "NULL"].includes(word)) return words[at++];
    return node();
  }
  const top = [];
  while (at < words.length) top.push(node());
  return top.filter((one) => one);
}

const top = readNodes(zlib.gunzipSync(fs.readFileSync(faceFile)).toString("utf8"));
const fdp = top.find((node) => node.type === "Face").fields.fdp.fields;

// Shapes in the file's order, each with its Transforms, the outermost first, and the number of its first vertex.
const shapes = [];
function walk(node, above) {
  if (node.type === "Shape") {
    const last = shapes.at(-1);
    const start = last ? last.start + last.rest.length / 3 : 0;
    shapes.push({ node, above, start, rest: node.fields.geometry.fields.coord.fields.point });
  }
  const below = node.type === "Transform" ? [...above, node] : above;
  for (const child of node.fields.children ?? []) walk(child, below);
}
for (const node of top) walk(node, []);

// FAPUs, measured between the feature points.
const sizes = { 2: 14, 3: 14, 4: 6, 5: 4, 6: 4, 7: 1, 8: 10, 9: 15, 10: 10, 11: 6 };
const points = {};
const places = fdp.featurePointsCoord.fields.point;
let read = 0;
for (const group of Object.keys(sizes)) {
  for (let k = 1; k <= sizes[group]; k++, read++) points[`${group}.${k}`] = places.slice(3 * read, 3 * read + 3);
}
const [x, y] = [(key) => points[key][0], (key) => points[key][1]];
const UNITS = [
  [(y("3.1") - y("3.3") + y("3.2") - y("3.4")) / 2 / 1024, [19, 20, 21, 22, 29, 30]],
  [(x("3.5") - x("3.6")) / 1024, [27, 28, 37, 38, 39, 40]],
  [((y("3.5") + y("3.6")) / 2 - y("9.15")) / 1024, [31, 32, 33, 34, 35, 36, 41, 42, 61, 62, 63, 64, 65, 66, 67, 68]],
  [(y("9.15") - y("2.2")) / 1024, [3, 4, 5, 8, 9, 10, 11, 12, 13, 14, 16, 17, 18, 44, 46, 51, 52, 55, 56, 57, 58, 59, 60]],
  [(x("8.3") - x("8.4")) / 1024, [6, 7, 15, 43, 45, 53, 54]],
  [1e-5, [23, 24, 25, 26, 47, 48, 49, 50]],
  [1, [1, 2]],
];
const unitOf = (fap) => UNITS.find(([, faps]) => faps.includes(fap))[0];

// What each interval contributes at a value: the length that the value covers of it.
function lengths(borders, value) {
  const count = borders.length - 1;
  if (count === 1) return [value];
  const out = new Array(count).fill(0);
  const zero = borders.indexOf(0);
  if (value >= 0 && zero === count) out[count - 1] = -value;
  else if (value < 0 && zero === 0) out[0] = value;
  else if (value >= 0) {
    for (let i = zero; i < count; i++) {
      const end = i === count - 1 ? value : Math.min(value, borders[i + 1]);
      out[i] = Math.max(0, end - borders[i]);
    }
  } else {
    for (let i = zero - 1; i >= 0; i--) {
      const end = i === 0 ? value : Math.max(value, borders[i]);
      out[i] = Math.max(0, borders[i + 1] - end);
    }
  }
  return out;
}

// A point turned about a center: the axis and angle of VRML97.
function turned(point, [ax, ay, az, angle], center) {
  const size = Math.hypot(ax, ay, az);
  const k = [ax / size, ay / size, az / size];
  const p = point.map((c, i) => c - center[i]);
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const along = (1 - cos) * (k[0] * p[0] + k[1] * p[1] + k[2] * p[2]);
  const cross = [k[1] * p[2] - k[2] * p[1], k[2] * p[0] - k[0] * p[2], k[0] * p[1] - k[1] * p[0]];
  return p.map((c, i) => c * cos + cross[i] * sin + k[i] * along + center[i]);
}

const ids = JSON.parse(fs.readFileSync(idsFile));
function pose(values, viseme, expression) {
  const moved = new Map(shapes.map((shape) => [shape.node, Float64Array.from(shape.rest)]));
  const rotations = new Map();
  for (const { fields } of fdp.faceDefTables) {
    const fap = fields.fapID[0];
    const select = fields.highLevelSelect?.[0] ?? 1;
    let value = values[fap] ?? 0;
    if (fap === 1) value = (viseme[0] === select) * viseme[2] + (viseme[1] === select) * (63 - viseme[2]);
    if (fap === 2) value = (expression[0] === select) * expression[1] + (expression[2] === select) * expression[3];
    if (value === 0) continue;
    for (const { fields: mesh } of fields.faceDefMesh ?? []) {
      const target = moved.get(mesh.faceSceneGraphNode);
      const parts = lengths(mesh.intervalBorders, value);
      mesh.coordIndex.forEach((vertex, k) => {
        parts.forEach((length, i) => {
          const slope = 3 * (k * parts.length + i);
          for (let c = 0; c < 3; c++) target[3 * vertex + c] += unitOf(fap) * length * mesh.displacements[slope + c];
        });
      });
    }
    for (const { fields: turn } of fields.faceDefTransform ?? []) {
      const [ax, ay, az, theta] = turn.rotationDef;
      rotations.set(turn.faceSceneGraphNode, [ax, ay, az, theta * value * 1e-5]);
    }
  }
  return ids.flatMap((id) => {
    const shape = shapes.findLast((one) => one.start <= id);
    const first = 3 * (id - shape.start);
    let point = Array.from(moved.get(shape.node).subarray(first, first + 3));
    for (const transform of [...shape.above].reverse()) {
      const { center, rotation, translation } = transform.fields;
      point = turned(point, rotations.get(transform) ?? rotation ?? [0, 0, 1, 0], center ?? [0, 0, 0]);
      point = point.map((c, i) => c + (translation?.[i] ?? 0));
    }
    return point;
  });
}

const lines = fs.readFileSync(streamFile, "utf8").split("\n").filter((line) => line.trim());
const numbers = (line) => line.trim().split(/\s+/).map(Number);
const NONE = [0, 0, 0, 0];
const frames = [pose({}, NONE, NONE)];
for (let k = 1; k < lines.length; k += 2) {
  const [mask, given] = [numbers(lines[k]), numbers(lines[k + 1])];
  let next = 1; // The number of the frame comes first.
  const take = (count) => given.slice(next, (next += count));
  const viseme = mask[0] ? take(4) : NONE;
  const expression = mask[1] ? take(6) : NONE;
  const values = {};
  for (let fap = 3; fap <= 68; fap++) if (mask[fap - 1]) values[fap] = take(1)[0];
  frames.push(pose(values, viseme, expression));
}
fs.writeFileSync(outFile, Buffer.from(Float32Array.from(frames.flat()).buffer));
