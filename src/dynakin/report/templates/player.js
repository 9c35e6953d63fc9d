(function () {
  "use strict";
  var root = document.getElementById("player");
  var data = JSON.parse(document.getElementById("player-data").textContent);
  var stage = root.querySelector(".stage"), unpack = dynakinPlayer.unpack, text = dynakinPlayer.text;
  var points = unpack(data.points), arrows = unpack(data.arrows), forces = unpack(data.forces);
  var angles = unpack(data.angles), moments = unpack(data.moments), derived = unpack(data.derived);
  var kinds = [["measured", unpack(data.measured)], ["estimated", unpack(data.estimated)]];
  function all(selector) { return Array.prototype.slice.call(root.querySelectorAll(selector)); }
  var bones = all(".bone"), joints = all(".joint"), rows = all("tbody tr.coordinate"), sizes = all(".size");
  var dots = { measured: all(".dot.measured"), estimated: all(".dot.estimated") };
  var lines = all(".arrow");

  function line(element, x1, y1, x2, y2) {
    var seen = isFinite(x1 + y1 + x2 + y2);
    element.style.display = seen ? "" : "none";
    if (!seen) { return; }
    element.setAttribute("x1", x1); element.setAttribute("y1", y1);
    element.setAttribute("x2", x2); element.setAttribute("y2", y2);
  }
  function dot(element, x, y) {
    var seen = isFinite(x + y);
    element.style.display = seen ? "" : "none";
    if (seen) { element.setAttribute("cx", x); element.setAttribute("cy", y); }
  }
  dynakinPlayer.run(root, data.time, function (frame) {
    bones.forEach(function (bone, i) {
      var a = data.bones[i][0], b = data.bones[i][1];
      line(bone, points(frame, 2 * a), points(frame, 2 * a + 1), points(frame, 2 * b), points(frame, 2 * b + 1));
      dot(joints[i], points(frame, 2 * a), points(frame, 2 * a + 1));
    });
    var middle = 0, count = 0;
    kinds.forEach(function (kind) {
      dots[kind[0]].forEach(function (element, i) {
        var x = kind[1](frame, 2 * i), y = kind[1](frame, 2 * i + 1);
        dot(element, x, y);
        if (isFinite(x)) { middle += x; count += 1; }
      });
    });
    lines.forEach(function (arrow, i) {
      line(arrow, arrows(frame, 4 * i), arrows(frame, 4 * i + 1), arrows(frame, 4 * i + 2), arrows(frame, 4 * i + 3));
      arrow.classList.toggle("derived", i === 1 && derived(frame, rows.length) > 0.5);
    });
    if (data.follow && count) {
      stage.setAttribute("viewBox", [middle / count - data.view[2] / 2, data.view[1], data.view[2], data.view[3]].join(" "));
    }
    rows.forEach(function (row, i) {
      var unit = data.units[i];
      row.cells[1].textContent = text(angles(frame, i), 1, unit[0]);
      row.cells[2].textContent = (derived(frame, i) > 0.5 ? "≈ " : "") + text(moments(frame, i), 1, unit[1]);
    });
    sizes.forEach(function (cell, i) { cell.textContent = text(forces(frame, i), 0, "N"); });
  });
}());
