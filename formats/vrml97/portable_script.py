"""The Script that plays Facial Animation Tables in a browser: the rule of FaceDefMesh, in the ECMAScript of VRML97.

It stands in the body of the Face's PROTO, sees the tables through the fields of their PROTOs, and writes the
coordinates of the shapes. Only what every ECMAScript has is used: no typed arrays, no classes, no modules.
"""

from __future__ import annotations

SCRIPT = """javascript:
var tables, rest, points, moved, waiting;

function initialize() {
  var i, j, list = fdp.faceDefTables;
  tables = []; rest = []; points = []; moved = [];
  for (i = 0; i < coords.length; i++) {
    rest[i] = numbers(coords[i].point);
    points[i] = new MFVec3f();
    for (j = 0; j < rest[i].length; j += 3) points[i][j / 3] = new SFVec3f(rest[i][j], rest[i][j + 1], rest[i][j + 2]);
    moved[i] = [];
  }
  for (i = 0; i < list.length; i++) {
    tables[i] = { node: list[i], unit: list[i].unit, meshes: null };
  }
  waiting = true;
  pose();
}

function numbers(vectors) {
  var k, v, out = [];
  for (k = 0; k < vectors.length; k++) { v = vectors[k]; out[3 * k] = v.x; out[3 * k + 1] = v.y; out[3 * k + 2] = v.z; }
  return out;
}

function copy(list) {
  var k, out = [];
  for (k = 0; k < list.length; k++) out[k] = list[k];
  return out;
}

// The tables are read when they are needed first, since a browser takes its time over long lists.
function meshes(table) {
  var j, list = table.node.faceDefMesh;
  if (table.meshes) return table.meshes;
  table.meshes = [];
  for (j = 0; j < list.length; j++) table.meshes[j] = mesh(list[j]);
  return table.meshes;
}

function mesh(node) {
  return { shape: node.shape, borders: copy(node.intervalBorders), index: copy(node.coordIndex),
           slopes: numbers(node.displacements) };
}

// How far each interval is used: below zero its slope points to where the vertex goes as the value falls; the first
// and the last interval have no end.
function uses(borders, value) {
  var k, low, high, part, n = borders.length - 1, out = [];
  if (n == 1) return [value];
  for (k = 0; k < n; k++) {
    low = borders[k]; high = borders[k + 1]; part = value;
    if (k > 0 && part < low) part = low;
    if (k < n - 1 && part > high) part = high;
    out[k] = high <= 0 ? high - part : part - low;
  }
  return out;
}

function set_value(value) { waiting = true; }

function eventsProcessed() { if (waiting && tables) pose(); }

function pose() {
  var i, j, k, m, n, v, at, use, list, value, factor, sums, seen, old;
  waiting = false;
  sums = []; seen = [];
  for (i = 0; i < points.length; i++) { sums[i] = {}; seen[i] = []; }
  for (i = 0; i < tables.length; i++) {
    value = tables[i].node.value;
    if (value == 0) continue;
    list = meshes(tables[i]);
    for (j = 0; j < list.length; j++) {
      m = list[j];
      use = uses(m.borders, value);
      n = use.length;
      for (k = 0; k < m.index.length; k++) {
        v = m.index[k];
        at = sums[m.shape][v];
        if (!at) { at = sums[m.shape][v] = [0, 0, 0]; seen[m.shape].push(v); }
        for (var p = 0; p < n; p++) {
          factor = use[p] * tables[i].unit;
          if (factor == 0) continue;
          var d = 3 * (k * n + p);
          at[0] += factor * m.slopes[d]; at[1] += factor * m.slopes[d + 1]; at[2] += factor * m.slopes[d + 2];
        }
      }
    }
  }
  for (i = 0; i < points.length; i++) {
    old = moved[i];
    if (!old.length && !seen[i].length) continue;
    for (k = 0; k < old.length; k++) if (!sums[i][old[k]]) place(i, old[k], [0, 0, 0]);
    for (k = 0; k < seen[i].length; k++) place(i, seen[i][k], sums[i][seen[i][k]]);
    moved[i] = seen[i];
    coords[i].point = points[i];
  }
}

function place(i, v, by) {
  var r = rest[i];
  points[i][v] = new SFVec3f(r[3 * v] + by[0], r[3 * v + 1] + by[1], r[3 * v + 2] + by[2]);
}
"""
"""The url of the Script. Its fields: fdp (the FDP), coords (the Coordinate of each shape), and the event set_value."""
