var dynakinPlayer = (function () {
  "use strict";
  // Column after column, changes between frames as variable-length numbers; 0: missing (dynakin.report.playback).
  function unpack(packed, rows) {
    var text = atob(packed.values), numbers = new Float32Array(rows * packed.columns), at = 0, last = 0, k;
    function next() {
      var byte, code = 0, place = 1;
      do { byte = text.charCodeAt(at++); code += (byte & 127) * place; place *= 128; } while (byte & 128);
      return code;
    }
    for (k = 0; k < numbers.length; k++) {
      if (k % rows === 0) { last = 0; }
      var code = next();
      if (code) { last += code % 2 ? (code - 1) / 2 : -code / 2; }
      numbers[k] = code ? last * packed.step : NaN;
    }
    return function (row, column) { return numbers[column * rows + row]; };
  }
  function text(value, digits, unit) {
    if (!isFinite(value)) { return "–"; }
    var rounded = value.toFixed(digits);
    if (Number(rounded) === 0) { rounded = (0).toFixed(digits); }
    return rounded.replace("-", "−") + (unit ? " " + unit : "");
  }
  // Clock, slider and button; draw(k) shows frame k. Returns what moves them.
  function run(root, times, draw) {
    var slider = root.querySelector("input"), button = root.querySelector(".controls button");
    var speed = root.querySelector("select"), clock = root.querySelector("output"), cursor = root.querySelector(".cursor");
    var still = window.matchMedia("(prefers-reduced-motion: reduce)");
    var last = times.length - 1, frame = 0, playing = false, from = 0, since = 0;
    function show(k) {
      frame = Math.max(0, Math.min(last, k));
      draw(frame);
      var now = times[frame].toFixed(2) + " s";
      clock.textContent = now;
      slider.value = frame;
      slider.setAttribute("aria-valuetext", now);
      if (cursor) {
        var share = 1000 * (times[frame] - times[0]) / Math.max(times[last] - times[0], 1e-9);
        cursor.setAttribute("x1", share); cursor.setAttribute("x2", share);
      }
    }
    function at(time) {
      var low = 0, high = last;
      while (low < high) {
        var half = (low + high + 1) >> 1;
        if (times[half] <= time) { low = half; } else { high = half - 1; }
      }
      return low;
    }
    function play(on) {
      playing = on;
      root.classList.toggle("playing", on);
      button.lastChild.textContent = on ? "Pause" : "Play";
      if (!on) { return; }
      if (frame === last) { show(0); }
      from = times[frame]; since = performance.now();
      var drawn = since;
      requestAnimationFrame(function step(instant) {
        if (!playing) { return; }
        var reached = at(from + Number(speed.value) * Math.max(0, instant - since) / 1000);
        // Who asked for less motion gets a still picture every second instead of a film.
        if (reached !== frame && (!still.matches || instant - drawn > 1000 || reached === last)) {
          show(reached); drawn = instant;
        }
        if (reached === last) { play(false); } else { requestAnimationFrame(step); }
      });
    }
    button.addEventListener("click", function () { play(!playing); });
    slider.addEventListener("input", function () { play(false); show(Number(slider.value)); });
    speed.addEventListener("change", function () { from = times[frame]; since = performance.now(); });
    root.classList.add("ready");
    show(Number(root.getAttribute("data-start")) || 0);
    return { toggle: function () { play(!playing); }, redraw: function () { draw(frame); }, frame: function () { return frame; } };
  }
  return { unpack: unpack, text: text, run: run };
}());
(function () {
  "use strict";
  var root = document.getElementById("player");
  var data = JSON.parse(document.getElementById("player-data").textContent);
  var unpack = dynakinPlayer.unpack, text = dynakinPlayer.text;
  var canvas = root.querySelector("canvas"), pen = canvas.getContext("2d");
  var arrays = {};
  Object.keys(data.arrays).forEach(function (name) { arrays[name] = unpack(data.arrays[name], data.time.length); });
  var cells = Array.prototype.slice.call(root.querySelectorAll("td[data-column]"));
  var azimuth = data.view.azimuth, elevation = data.view.elevation, zoom = 1, player = null;
  var size = { width: 0, height: 0, scale: 1 };
  var INK = "#1d2530", FLOOR = "#d3dae0";

  // Ground frame: X forward, Y up, Z right. Azimuth 0 looks from the right, 90 degrees from the front.
  function camera(frame) {
    var a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180;
    var ca = Math.cos(a), sa = Math.sin(a), ce = Math.cos(e), se = Math.sin(e);
    var cx = data.view.follow ? arrays.centre(frame, 0) : data.view.x, cz = data.view.follow ? arrays.centre(frame, 1) : data.view.z;
    var s = size.scale * zoom;
    return function (x, y, z) {
      var across = (x - cx) * ca - (z - cz) * sa, near = (x - cx) * sa + (z - cz) * ca, up = y - data.view.middle;
      return [size.width / 2 + s * across, size.height / 2 - s * (up * ce - near * se), up * se + near * ce];
    };
  }
  function at(project, array, frame, k) {
    var x = array(frame, 3 * k), y = array(frame, 3 * k + 1), z = array(frame, 3 * k + 2);
    return isFinite(x + y + z) ? project(x, y, z) : null;
  }
  function stroke(a, b, colour, width) {
    pen.strokeStyle = colour; pen.lineWidth = width; pen.beginPath();
    pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.stroke();
  }
  function floor(project, frame) {
    var y = data.view.floor, half = data.view.radius * 1.15, step = data.view.square, k, level;
    var cx = data.view.follow ? arrays.centre(frame, 0) : data.view.x, cz = data.view.follow ? arrays.centre(frame, 1) : data.view.z;
    // From the side the squares are a line with a mark for each, all across the picture.
    if (!data.view.turns) {
      level = project(cx, y, cz)[1];
      stroke([0, level], [size.width, level], FLOOR, 2);
      half = Math.min(0.5 * size.width / (size.scale * zoom), 100 * step);
    }
    for (k = Math.ceil((cx - half) / step); k * step <= cx + half; k++) {
      if (data.view.turns) { stroke(project(k * step, y, cz - half), project(k * step, y, cz + half), FLOOR, 1); }
      else { stroke(project(k * step, y, cz), project(k * step, y - 22, cz), FLOOR, 2); }
    }
    for (k = Math.ceil((cz - half) / step); data.view.turns && k * step <= cz + half; k++) {
      stroke(project(cx - half, y, k * step), project(cx + half, y, k * step), FLOOR, 1);
    }
  }
  // By where a number comes from: measured, derived, prior, absent.
  var SOURCES = [{ dash: [], mark: "" }, { dash: [7, 5], mark: "≈ " }, { dash: [2, 3], mark: "≈? " }, { dash: [], mark: "" }];
  function source(array, frame, column) { return SOURCES[Math.round(array(frame, column))]; }
  function arrow(project, frame, entry) {
    var p = arrays[entry.points], f = arrays[entry.forces], k = 3 * entry.k;
    var x = p(frame, k), y = p(frame, k + 1), z = p(frame, k + 2);
    if (!isFinite(x + y + z + f(frame, k))) { return; }
    var g = data.view.mm_per_newton, a = project(x, y, z);
    var b = project(x + g * f(frame, k), y + g * f(frame, k + 1), z + g * f(frame, k + 2));
    var dx = b[0] - a[0], dy = b[1] - a[1], long = Math.hypot(dx, dy), head = Math.min(4 * entry.width + 4, long);
    pen.setLineDash(entry.sourced ? source(arrays.sources, frame, entry.k).dash : []);
    pen.lineCap = "butt";
    stroke(a, b, entry.colour, entry.width);
    pen.setLineDash([]);
    pen.lineCap = "round";
    if (long < 2) { return; }
    dx /= long; dy /= long;
    pen.fillStyle = entry.colour; pen.beginPath();
    pen.moveTo(b[0] + 2 * dx, b[1] + 2 * dy);
    pen.lineTo(b[0] - head * dx - 0.5 * head * dy, b[1] - head * dy + 0.5 * head * dx);
    pen.lineTo(b[0] - head * dx + 0.5 * head * dy, b[1] - head * dy - 0.5 * head * dx);
    pen.fill();
  }
  function circle(p, radius, fill, edge, width) {
    pen.beginPath(); pen.arc(p[0], p[1], radius, 0, 2 * Math.PI);
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    if (edge) { pen.strokeStyle = edge; pen.lineWidth = width; pen.stroke(); }
  }
  function draw(frame) {
    var project = camera(frame), thick = Math.max(2.5, 26 * size.scale * zoom), items = [];
    pen.clearRect(0, 0, size.width, size.height);
    pen.lineCap = "round";
    floor(project, frame);
    data.arrows.forEach(function (entry) { if (entry.behind) { arrow(project, frame, entry); } });
    data.bones.forEach(function (bone) {
      var a = at(project, arrays.points, frame, bone[0]), b = at(project, arrays.points, frame, bone[1]);
      if (a && b) { items.push([(a[2] + b[2]) / 2, function () { stroke(a, b, bone[2], thick); circle(a, 0.42 * thick, "#fff"); }]); }
    });
    data.markers.forEach(function (marker, k) {
      var a = at(project, arrays.estimated, frame, k), b = at(project, arrays.measured, frame, k);
      if (a) { items.push([a[2], function () { circle(a, 2.6, marker[1], "#fff", 0.8); }]); }
      if (b) { items.push([b[2], function () { circle(b, 4.2, null, "#4d5661", 1.2); }]); }
    });
    items.sort(function (one, other) { return one[0] - other[0]; });
    items.forEach(function (item) { item[1](); });
    data.arrows.forEach(function (entry) { if (!entry.behind) { arrow(project, frame, entry); } });
    if (arrays.mass_centre) {
      var c = at(project, arrays.mass_centre, frame, 0);
      if (c) {
        circle(c, 7, "#fff", INK, 1.5);
        pen.fillStyle = INK;
        [0, 1].forEach(function (half) {
          pen.beginPath(); pen.moveTo(c[0], c[1]);
          pen.arc(c[0], c[1], 7, half * Math.PI, (half + 0.5) * Math.PI); pen.fill();
        });
      }
    }
    cells.forEach(function (cell) {
      var name = cell.getAttribute("data-array"), column = Number(cell.getAttribute("data-column"));
      var mark = name === "moments" ? source(arrays.moment_sources, frame, column).mark : "";
      cell.textContent = mark + text(arrays[name](frame, column), Number(cell.getAttribute("data-digits")), "");
    });
  }
  function fit() {
    var ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
    if (!box.width) { return; }
    size.width = box.width; size.height = box.height;
    canvas.width = Math.round(ratio * box.width); canvas.height = Math.round(ratio * box.height);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    size.scale = Math.min(box.width / (2.1 * data.view.radius), box.height / (1.22 * data.view.height));
    if (player) { player.redraw(); }
  }
  function turn(dx, dy) {
    if (!data.view.turns) { return; }
    azimuth = (azimuth + dx + 540) % 360 - 180;
    elevation = Math.max(-10, Math.min(90, elevation + dy));
    player.redraw();
  }
  root.classList.add("ready");
  fit();
  player = dynakinPlayer.run(root, data.time, draw);
  if (window.ResizeObserver) { new ResizeObserver(fit).observe(canvas); } else { window.addEventListener("resize", fit); }
  canvas.addEventListener("mousemove", function (event) {
    var box = canvas.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top;
    var near = 10, found = "";
    data.markers.forEach(function (marker, k) {
      [arrays.estimated, arrays.measured].forEach(function (array) {
        var p = at(camera(player.frame()), array, player.frame(), k), away = p ? Math.hypot(p[0] - x, p[1] - y) : near;
        if (away < near) { near = away; found = marker[0]; }
      });
    });
    canvas.title = found;
  });
  var held = null;
  canvas.addEventListener("pointerdown", function (event) {
    held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", function (event) {
    if (!held) { return; }
    turn(-0.5 * (event.clientX - held[0]), 0.4 * (event.clientY - held[1]));
    held = [event.clientX, event.clientY];
  });
  ["pointerup", "pointercancel"].forEach(function (name) { canvas.addEventListener(name, function () { held = null; }); });
  canvas.addEventListener("keydown", function (event) {
    var moves = { ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] };
    if (event.ctrlKey || event.metaKey || event.altKey) { return; }
    if (moves[event.key]) { turn(moves[event.key][0], moves[event.key][1]); }
    else if (event.key === "+" || event.key === "=") { zoom = Math.min(4, 1.2 * zoom); player.redraw(); }
    else if (event.key === "-") { zoom = Math.max(0.5, zoom / 1.2); player.redraw(); }
    else if (event.key === " ") { player.toggle(); }
    else { return; }
    event.preventDefault();
  });
  Array.prototype.forEach.call(root.querySelectorAll("button[data-azimuth]"), function (button) {
    button.addEventListener("click", function () {
      azimuth = Number(button.getAttribute("data-azimuth")); elevation = Number(button.getAttribute("data-elevation")); zoom = 1;
      player.redraw();
    });
  });
}());
