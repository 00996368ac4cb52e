// The report's interactive views. Each draws over a picture, which stays where drawing is not possible, and is what is printed.
"use strict";
(() => {
  // Colours that stay apart for colour-blind readers (Okabe & Ito); the last is the page's ink.
  const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];
  const DASHES = ["solid", "dash", "dot", "dashdot"];
  const KINDS = { ours: "what the optimiser uses", polynomial: "f·g fitted to our points", published: "f·g as the paper prints it" };
  const SCALARS = {
    displacement: "displacement (mm)", speed: "speed (mm/s)", coordination: "coordination number",
    "height at the start": "height at the start (mm)",
  };
  const MILLISECONDS_PER_FRAME = 120;

  // --- data

  const text = (id) => document.getElementById(id).textContent;
  const once = (make) => { let made; return () => (made ??= make()); };

  async function inflated(packed) {
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  const unpackedText = async (packed) => new TextDecoder().decode(await inflated(packed));
  const views = once(async () => JSON.parse(await unpackedText(text("views-data"))));
  const stored = once(() => JSON.parse(text("grains-data")));
  const plotly = once(async () => {
    const script = document.createElement("script");
    script.textContent = await unpackedText(text("plotly-code"));
    document.head.append(script);
    return window.Plotly;
  });

  // Grains as `pack.packed_grains` wrote them, in mm.
  async function unpackedGrains(header) {
    const { n, low_mm: low, step_mm: step } = header;
    const bytes = await inflated(header.data);
    const plane = (k) => bytes.subarray(k * n, (k + 1) * n);
    const steps = [0, 2, 4].map((k) => Uint16Array.from(plane(k), (value, i) => value + 256 * bytes[(k + 1) * n + i]));
    for (let i = 1; i < n; i++) steps[0][i] += steps[0][i - 1];
    const [x, y, z] = steps.map((axis, k) => Array.from(axis, (value) => low[k] + step * value));
    const scalars = {};
    Object.entries(header.scalars).forEach(([name, [from, to]], k) => {
      scalars[name] = Array.from(plane(6 + k), (value) => from + ((to - from) * value) / header.levels);
    });
    const radii = scalars.radius ?? new Array(n).fill(header.radius_mm);
    delete scalars.radius;
    return { x, y, z, radii, scalars };
  }

  // --- controls

  function element(tag, properties, ...children) {
    const node = Object.assign(document.createElement(tag), properties);
    node.append(...children);
    return node;
  }

  function chooser(controls, label, entries, changed) {
    const select = element("select", { onchange: () => changed() });
    const fill = (list) => select.replaceChildren(...list.map(([value, shown]) => element("option", { value }, shown)));
    fill(entries);
    controls.append(element("label", {}, label, select));
    return { get value() { return select.value; }, set value(value) { select.value = value; }, fill, select };
  }

  function slider(controls, label, n, shown, changed) {
    const output = element("output", {});
    const input = element("input", { type: "range", min: 0, max: n - 1, value: 0 });
    const say = () => {
      output.textContent = shown(input.valueAsNumber);
      input.setAttribute("aria-valuetext", output.textContent);
    };
    input.oninput = () => { say(); changed(); };
    const span = element("span", {}, `${label}: `, output);
    controls.append(element("label", {}, span, input));
    say();
    return { get value() { return input.valueAsNumber; }, set value(value) { input.value = value; say(); } };
  }

  function button(controls, label, pressed) {
    const node = element("button", { type: "button", onclick: () => pressed() }, label);
    controls.append(node);
    return node;
  }

  function download(name, rows) {
    const url = URL.createObjectURL(new Blob([typeof rows === "string" ? rows : rows.map((row) => row.join(",")).join("\n") + "\n"]));
    element("a", { href: url, download: `${name}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  }

  // --- what all plots share

  const theme = () => {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(["ink", "quiet", "paper", "line", "soft"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  };
  const touched = matchMedia("(pointer: coarse)").matches;
  const SETTINGS = {
    displaylogo: false, responsive: true, scrollZoom: false,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "resetCameraLastSave3d", "hoverClosest3d", "tableRotation", "autoScale2d", "sendChartToCloud"],
  };

  function layout(more) {
    const { ink, paper, line } = theme();
    const axis = { gridcolor: line, zerolinecolor: line, linecolor: line };
    const base = {
      font: { color: ink, family: "system-ui, sans-serif", size: 13 }, paper_bgcolor: paper, plot_bgcolor: paper,
      margin: { l: 60, r: 15, t: 15, b: 50 }, uirevision: "kept", dragmode: touched ? false : "zoom",
      legend: { bgcolor: "rgba(0,0,0,0)", orientation: "h", y: 1.02, yanchor: "bottom" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: theme().quiet, activecolor: ink },
      hoverlabel: { bgcolor: paper, font: { color: ink } },
    };
    const result = { ...base, ...more };
    for (const name of ["xaxis", "yaxis"]) if (result[name]) result[name] = { ...axis, ...result[name] };
    return result;
  }

  function scene(titles, more) {
    const { line, soft } = theme();
    const axis = (title) => ({ title: { text: title }, gridcolor: line, zerolinecolor: line, backgroundcolor: soft, showbackground: false });
    const [xaxis, yaxis, zaxis] = titles.map(axis);
    return { xaxis, yaxis, zaxis, ...more };
  }

  const colourBar = (title) => ({ title: { text: title, side: "right" }, thickness: 14, len: 0.8, outlinewidth: 0, tickcolor: theme().line });

  // Arrow keys turn a 3D view, plus and minus bring it nearer and farther.
  function turnable(plot, Plotly, label) {
    plot.tabIndex = 0;
    plot.setAttribute("role", "group");
    plot.setAttribute("aria-label", `${label}; arrow keys turn it, plus and minus zoom`);
    const zoom = (factor) => {
      const { camera, aspectratio } = plot._fullLayout.scene;
      if (camera.projection.type === "orthographic") {
        const scaled = Object.fromEntries(Object.entries(aspectratio).map(([name, value]) => [name, value * factor]));
        Plotly.relayout(plot, { "scene.aspectmode": "manual", "scene.aspectratio": scaled });
      } else {
        const { x, y, z } = camera.eye;
        Plotly.relayout(plot, { "scene.camera.eye": { x: x / factor, y: y / factor, z: z / factor } });
      }
    };
    const turn = (sideways, upwards) => {
      const { x, y, z } = plot._fullLayout.scene.camera.eye;
      const distance = Math.hypot(x, y, z);
      const azimuth = Math.atan2(y, x) + sideways;
      const height = Math.min(Math.max(Math.asin(z / distance) + upwards, -1.5), 1.5);
      const flat = distance * Math.cos(height);
      const eye = { x: flat * Math.cos(azimuth), y: flat * Math.sin(azimuth), z: distance * Math.sin(height) };
      Plotly.relayout(plot, { "scene.camera.eye": eye });
    };
    const actions = {
      ArrowLeft: () => turn(-0.15, 0), ArrowRight: () => turn(0.15, 0), ArrowUp: () => turn(0, 0.15), ArrowDown: () => turn(0, -0.15),
      "+": () => zoom(1.2), "-": () => zoom(1 / 1.2),
    };
    plot.addEventListener("keydown", (event) => {
      if (event.target !== plot || !actions[event.key]) return;
      event.preventDefault();
      actions[event.key]();
    });
    return zoom;
  }

  const zoomButtons = (controls, zoom) => {
    button(controls, "Zoom in", () => zoom(1.25));
    button(controls, "Zoom out", () => zoom(0.8));
  };

  // --- grains

  // Pixels per mm of a view without perspective: the squares of three perpendicular unit lengths on the screen add up to twice its square.
  function pixelsPerMm(plot) {
    const drawn = plot._fullLayout.scene._scene;
    const { model, view, projection } = drawn.glplot.cameraParams;
    const times = (m, v) => [0, 1, 2, 3].map((row) => v.reduce((sum, value, k) => sum + m[4 * k + row] * value, 0));
    const { w: width, h: height } = plot._fullLayout._size;
    let sum = 0;
    for (let k = 0; k < 3; k++) {
      const unit = [0, 0, 0, 0];
      unit[k] = drawn.dataScale[k];
      const [right, up] = times(projection, times(view, times(model, unit)));
      sum += ((right * width) / 2) ** 2 + ((up * height) / 2) ** 2;
    }
    return Math.sqrt(sum / 2);
  }

  function grainTrace(grains, colour) {
    const values = grains.scalars[colour];
    return {
      type: "scatter3d", mode: "markers", x: grains.x, y: grains.y, z: grains.z, text: values.map((value) => value.toPrecision(3)),
      hovertemplate: `%{text} ${SCALARS[colour]}<extra></extra>`, showlegend: false,
      marker: { color: values, colorscale: "Viridis", showscale: true, colorbar: colourBar(SCALARS[colour]), line: { width: 0.5, color: "#222" }, opacity: 1 },
    };
  }

  function grainRows(grains) {
    const names = Object.keys(grains.scalars);
    const columns = [grains.x, grains.y, grains.z, grains.radii, ...names.map((name) => grains.scalars[name])];
    const rows = grains.x.map((_, i) => columns.map((column) => column[i].toPrecision(5)));
    return [["x_mm", "y_mm", "z_mm", "radius_mm", ...names.map((name) => SCALARS[name])], ...rows];
  }

  // A 3D plot draws its circles as the letter ● of whatever font the machine has, four times as high as `marker.size` says (Plotly's code).
  const CIRCLE = "●", SIZE_FACTOR = 4;

  // Width of the drawn circle over its `marker.size`, from this machine's letter.
  function drawnSize() {
    const em = 64, side = 2 * em; // the size at which Plotly outlines it
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = side;
    const letter = canvas.getContext("2d");
    letter.font = `${em}px normal`; // as Plotly asks for it: a font that no machine has
    letter.fillText(CIRCLE, em / 2, 1.5 * em);
    const { data } = letter.getImageData(0, 0, side, side);
    const column = (x) => Array.from({ length: side }, (_, y) => data[4 * (y * side + x) + 3]).some((ink) => ink > 127);
    const width = Array.from({ length: side }, (_, x) => column(x)).filter(Boolean).length;
    return (SIZE_FACTOR * width) / em;
  }

  // Has the grains' circles keep their true size in a plot without perspective.
  function trueSize(plot, Plotly, radii) {
    const drawn = drawnSize();
    let last = 0;
    const set = () => {
      const scale = pixelsPerMm(plot);
      if (!(scale > 0) || Math.abs(scale / last - 1) < 0.02) return;
      last = scale;
      const sizes = radii().map((radius) => (2 * scale * radius) / drawn);
      Plotly.restyle(plot, { "marker.size": sizes.every((size) => size === sizes[0]) ? sizes[0] : [sizes] }, [0]);
    };
    plot.on("plotly_afterplot", set);
    plot.on("plotly_relayouting", set);
    return () => { last = 0; set(); };
  }

  const AXES_MM = ["x (mm)", "y (mm)", "z (mm)"];
  // Height of what a scene without perspective shows, in units of its aspect ratio.
  const SHOWN_HEIGHT = 2.34;

  // A scene without perspective at true proportions that fills its plot, seen from `eye`; spans: lowest and highest along x, y and z.
  function scaledScene(plot, spans, eye, more) {
    const sizes = spans.map(([low, high]) => high - low || 1);
    const [x, y, z] = eye.map((value) => value / Math.hypot(...eye));
    const flat = Math.hypot(x, y);
    const across = (sizes[0] * Math.abs(y) + sizes[1] * Math.abs(x)) / flat;
    const upwards = (sizes[0] * Math.abs(x * z) + sizes[1] * Math.abs(y * z)) / flat + sizes[2] * flat;
    const room = 0.8 * SHOWN_HEIGHT;
    const scale = room * Math.min(0.85 * plot.clientWidth / plot.clientHeight / across, 1 / upwards);
    const [a, b, c] = sizes.map((size) => scale * size);
    const camera = { eye: { x: eye[0], y: eye[1], z: eye[2] }, projection: { type: "orthographic" } };
    const look = scene(AXES_MM, { aspectmode: "manual", aspectratio: { x: a, y: b, z: c }, camera, dragmode: "orbit", ...more });
    [look.xaxis.range, look.yaxis.range, look.zaxis.range] = spans;
    return look;
  }

  const spanOf = (values, margin = 0) => [
    values.reduce((a, b) => Math.min(a, b), Infinity) - margin, values.reduce((a, b) => Math.max(a, b), -Infinity) + margin,
  ];

  async function grainView({ controls, plot, Plotly }) {
    const { tests, specimens } = stored();
    const pointsOf = () => Object.keys(tests[test.value]).map((label) => [label, label]);
    const runsOf = () => tests[test.value][point.value].map((run, k) => [k, run.label]);
    const newPoint = () => { run.fill(runsOf()); return draw(); };
    const newTest = () => { point.fill(pointsOf()); return newPoint(); };
    const test = chooser(controls, "Test", Object.keys(tests).map((name) => [name, specimens[name].words]), newTest);
    const point = chooser(controls, "Point", pointsOf(), newPoint);
    const run = chooser(controls, "Simulation", runsOf(), () => draw());
    const colour = chooser(controls, "Colour", [], () => draw());
    zoomButtons(controls, turnable(plot, Plotly, "Grains"));
    let shown, resize, latest = 0;
    async function draw() {
      const call = ++latest;
      const { grains: header } = tests[test.value][point.value][run.value];
      const offered = Object.keys(header.scalars).filter((name) => name in SCALARS).map((name) => [name, SCALARS[name]]);
      const kept = colour.value;
      colour.fill(offered);
      if (offered.some(([name]) => name === kept)) colour.value = kept;
      const grains = await unpackedGrains(header);
      if (call !== latest) return;
      shown = grains;
      const spans = [shown.x, shown.y, shown.z].map((axis) => spanOf(axis, shown.radii[0]));
      const { eye, flat } = specimens[test.value];
      const look = scaledScene(plot, spans, eye, { uirevision: test.value + point.value });
      if (flat) look.yaxis.visible = false; // seen edge on
      await Plotly.react(plot, [grainTrace(grains, colour.value)], layout({ scene: look, margin: { l: 0, r: 0, t: 10, b: 0 } }), SETTINGS);
      resize ??= trueSize(plot, Plotly, () => shown.radii);
      resize();
    }
    const csv = () => grainRows(shown);
    return { draw, csv, name: () => `grains_${tests[test.value][point.value][run.value].id}` };
  }

  async function liftView({ controls, plot, Plotly }) {
    const { lift } = stored();
    const frames = await Promise.all(lift.map((frame) => unpackedGrains(frame.grains)));
    const time = slider(controls, "Time", lift.length, (k) => `${lift[k].time_s.toFixed(3)} s, tube ${lift[k].tube.bottom_mm.toFixed(2)} mm up`, () => draw());
    const play = button(controls, "Play", () => (timer ? stop() : start()));
    const names = Object.keys(frames[0].scalars);
    const colour = chooser(controls, "Colour", names.map((name) => [name, SCALARS[name]]), () => draw());
    zoomButtons(controls, turnable(plot, Plotly, "Lift of the tube"));
    let timer, resize;
    const stop = () => { clearInterval(timer); timer = undefined; play.textContent = "Play"; };
    const step = () => {
      if (time.value === lift.length - 1) return stop();
      time.value += 1;
      return draw();
    };
    const start = () => {
      if (time.value === lift.length - 1) time.value = 0;
      play.textContent = "Pause";
      timer = setInterval(step, MILLISECONDS_PER_FRAME);
    };
    const radius = frames[0].radii[0];
    const top = Math.max(...lift.map((frame) => frame.tube.bottom_mm), lift[0].tube.top_mm);
    const spans = [...["x", "y"].map((axis) => spanOf(frames.flatMap((frame) => frame[axis]), radius)), [0, top + radius]];
    // one scale of colours for all moments
    const limits = Object.fromEntries(names.map((name) => [name, Math.max(...frames.flatMap((frame) => frame.scalars[name].reduce((a, b) => Math.max(a, b), 0)))]));
    const tube = ({ radius_mm: r, bottom_mm: low, top_mm: top }) => {
      const [x, y, z] = [[], [], []];
      const around = Array.from({ length: 49 }, (_, k) => (2 * Math.PI * k) / 48);
      for (const height of [low, Math.max(top, low)]) {
        for (const angle of around) { x.push(r * Math.cos(angle)); y.push(r * Math.sin(angle)); z.push(height); }
        x.push(null); y.push(null); z.push(null);
      }
      for (const angle of around.filter((_, k) => k % 6 === 0)) {
        x.push(r * Math.cos(angle), r * Math.cos(angle), null); y.push(r * Math.sin(angle), r * Math.sin(angle), null); z.push(low, Math.max(top, low), null);
      }
      return { type: "scatter3d", mode: "lines", x, y, z, line: { color: theme().ink, width: 2 }, hoverinfo: "skip", showlegend: false };
    };
    async function draw() {
      const grains = frames[time.value];
      const trace = grainTrace(grains, colour.value);
      Object.assign(trace.marker, { cmin: 0, cmax: limits[colour.value] || 1, size: plot.data?.[0]?.marker?.size });
      const look = scaledScene(plot, spans, [0.6, -1.9, 0.5], { uirevision: "kept" });
      await Plotly.react(plot, [trace, tube(lift[time.value].tube)], layout({ scene: look, margin: { l: 0, r: 0, t: 10, b: 0 } }), SETTINGS);
      resize ??= trueSize(plot, Plotly, () => frames[time.value].radii);
      if (!trace.marker.size) resize();
    }
    const csv = () => grainRows(frames[time.value]);
    return { draw, csv, name: () => `lift_${lift[time.value].time_s.toFixed(4)}s` };
  }

  // --- responses

  const near = (value, radius, share = 0.02) => Math.abs(value / radius - 1) < share;
  const microns = (radius) => `${Number(radius.toPrecision(3))} µm`;

  // The kinds that have a surrogate for one of these responses.
  const kindsFor = (fields, names) => Object.entries(KINDS).filter(([kind]) => names.some((name) => fields[kind]?.[name]));
  // The optimiser's where a kind has none of its own.
  const fieldOf = (fields, kind, response, k) => (fields[kind][response] ?? fields.ours[response])[k];

  async function surfaceView({ controls, plot, Plotly }) {
    const { surfaces, responses } = await views();
    const { static: s, rolling: r, radii_um: radii, fields, simulated } = surfaces;
    const response = chooser(controls, "Response", Object.entries(responses), () => { offer(kind.value); return draw(); });
    const kind = chooser(controls, "Surrogate", [], () => draw());
    const offer = (last) => {
      const kinds = kindsFor(fields, [response.value]);
      kind.fill(kinds);
      kind.value = kinds.some(([name]) => name === last) ? last : "ours";
    };
    offer("ours");
    const radius = slider(controls, "Radius", radii.length, (k) => microns(radii[k]), () => draw());
    radius.value = baseRadius(surfaces);
    zoomButtons(controls, turnable(plot, Plotly, "Response surface"));
    const points = () => {
      const [at, ...columns] = simulated[response.value];
      return columns.map((column) => column.filter((_, i) => near(at[i], radii[radius.value])));
    };
    function draw() {
      const title = responses[response.value];
      const field = fieldOf(fields, kind.value, response.value, radius.value);
      const [x, y, z] = points();
      const surface = {
        type: "surface", x: s, y: r, z: field, colorscale: "Viridis", opacity: 0.9, colorbar: colourBar(title), name: "surrogate",
        hovertemplate: `µs %{x:.3g}, µr %{y:.3g}: %{z:.4g}<extra>surrogate</extra>`,
        contours: { x: { show: true, color: "rgba(0,0,0,.25)" }, y: { show: true, color: "rgba(0,0,0,.25)" } },
      };
      const dots = {
        type: "scatter3d", mode: "markers", x, y, z, marker: { size: 4, color: COLOURS[1], line: { color: "#000", width: 1 } },
        hovertemplate: `µs %{x:.3g}, µr %{y:.3g}: %{z:.4g}<extra>simulated</extra>`, showlegend: false,
      };
      const look = scene(["µs", "µr", title], { aspectmode: "cube", camera: { eye: { x: -1.4, y: -1.5, z: 0.7 } }, dragmode: "orbit", uirevision: "kept" });
      return Plotly.react(plot, [surface, dots], layout({ scene: look, margin: { l: 0, r: 0, t: 10, b: 0 } }), SETTINGS);
    }
    const csv = () => {
      const field = fieldOf(fields, kind.value, response.value, radius.value);
      const surrogate = field.flatMap((row, j) => row.map((value, i) => ["surrogate", s[i], r[j], value]));
      const [x, y, z] = points();
      return [["source", "static_friction", "rolling_friction", response.value], ...surrogate, ...x.map((_, i) => ["simulated", x[i], y[i], z[i]])];
    };
    return { draw, csv, name: () => `${response.value}_${kind.value}_${radii[radius.value].toPrecision(3)}um` };
  }

  // The radius at which most points were simulated.
  function baseRadius({ radii_um: radii, simulated }) {
    const counts = radii.map((radius) => Object.values(simulated).reduce((sum, [at]) => sum + at.filter((value) => near(value, radius)).length, 0));
    return counts.indexOf(Math.max(...counts));
  }

  async function isoView({ controls, plot, Plotly }) {
    const { surfaces, iso, responses } = await views();
    const { static: s, rolling: r, radii_um: radii, fields } = surfaces;
    const ofCase = () => { radius.value = iso[choice.value].radius; return draw(); };
    const choice = chooser(controls, "Case", Object.keys(iso).map((name) => [name, name]), ofCase);
    const kind = chooser(controls, "Surrogate", kindsFor(fields, Object.keys(responses)), () => draw());
    const radius = slider(controls, "Radius", radii.length, (k) => microns(radii[k]), () => draw());
    radius.value = iso[choice.value].radius;
    const curves = () => Object.keys(responses).flatMap((response, k) => {
      const target = iso[choice.value].targets[response];
      if (target === null || target === undefined) return [];
      const field = fieldOf(fields, kind.value, response, radius.value);
      const all = field.flat();
      const reached = Math.min(...all) <= target && target <= Math.max(...all);
      const band = Math.max(0.05 * Math.abs(target), 1);
      const name = `${responses[response].split(" (")[0]} ${target}${reached ? "" : ": nowhere here"}`;
      const hovertemplate = `µs %{x:.3g}, µr %{y:.3g}: %{z:.4g}<extra>${responses[response]}</extra>`;
      const curve = (levels, line, more) => ({
        type: "contour", x: s, y: r, z: field, showscale: false, autocontour: false, hovertemplate,
        contours: { coloring: "none", ...levels }, line: { color: COLOURS[k], ...line }, ...more,
      });
      return [
        curve({ start: target, end: target, size: 1 }, { width: 3 }, { name, showlegend: true, legendgroup: response }),
        curve({ start: target - band, end: target + band, size: 2 * band }, { width: 1, dash: "dot" }, { showlegend: false, legendgroup: response, hoverinfo: "skip" }),
      ];
    });
    function draw() {
      const { ink, quiet } = theme();
      const { posterior, equivalents, optimum } = iso[choice.value];
      const dots = (name, [x, y, at], marker, share) => {
        const kept = x.map((_, i) => share === undefined || near(at[i], radii[radius.value], share));
        const pick = (list) => list.filter((_, i) => kept[i]);
        return {
          type: "scatter", mode: "markers", name, marker, x: pick(x), y: pick(y), text: pick(at).map(microns),
          hovertemplate: `µs %{x:.3g}, µr %{y:.3g}, r %{text}<extra>${name}</extra>`,
        };
      };
      const traces = [
        dots("consistent, at any radius", posterior, { color: quiet, size: 3, opacity: 0.35 }),
        dots("consistent, within 20 % of this radius", posterior, { color: ink, size: 4, opacity: 0.8 }, 0.2),
        ...curves(),
        dots("equivalent sets", equivalents, { color: "rgba(0,0,0,0)", size: 9, line: { color: ink, width: 1.2 } }),
        { type: "scatter", mode: "markers", name: `optimum (r ${microns(radii[iso[choice.value].radius])})`, x: [optimum[0]], y: [optimum[1]], marker: { symbol: "star", size: 17, color: COLOURS[4], line: { color: ink, width: 1 } } },
      ];
      const wide = (axis) => [axis[0] - 0.02 * (axis.at(-1) - axis[0]), axis.at(-1) + 0.02 * (axis.at(-1) - axis[0])];
      const more = {
        xaxis: { title: { text: "static friction µs" }, range: wide(s), zeroline: false },
        yaxis: { title: { text: "rolling friction µr" }, range: wide(r), zeroline: false },
      };
      return Plotly.react(plot, traces, layout(more), SETTINGS);
    }
    return { draw };
  }

  async function shearView({ controls, plot, Plotly }) {
    const { shear } = await views();
    const labels = Object.keys(shear);
    const point = chooser(controls, "Point", labels.map((label) => [label, label]), () => draw());
    const base = labels.find((label) => label.endsWith("(base set)"));
    if (base) point.value = base;
    const along = chooser(controls, "Over", [["displacement", "displacement (mm)"], ["time", "time (s)"]], () => draw());
    function draw() {
      const curves = shear[point.value];
      const pressures = [...new Set(curves.map((curve) => curve.pressure))];
      const seen = {};
      const traces = curves.map((curve) => {
        const seed = (seen[curve.pressure] = (seen[curve.pressure] ?? -1) + 1);
        return {
          type: "scatter", mode: "lines", name: curve.label, x: curve[along.value], y: curve.stress,
          line: { color: COLOURS[pressures.indexOf(curve.pressure) % COLOURS.length], dash: DASHES[seed % DASHES.length], width: 1.8 },
        };
      });
      const over = { displacement: "displacement of the lower frame (mm)", time: "time since shearing began (s)" }[along.value];
      return Plotly.react(plot, traces, layout({ xaxis: { title: { text: over } }, yaxis: { title: { text: "shear stress (Pa)" } }, hovermode: "x" }), SETTINGS);
    }
    const csv = () => [
      ["simulation", "normal_stress_pa", "displacement_mm", "time_s", "shear_stress_pa"],
      ...shear[point.value].flatMap((curve) => curve.stress.map((stress, i) => [`"${curve.label}"`, curve.pressure, curve.displacement[i], curve.time[i], stress])),
    ];
    return { draw, csv, name: () => "shear_curves" };
  }

  // --- the page

  const KNOWN = { grains: grainView, lift: liftView, surfaces: surfaceView, iso: isoView, shear: shearView };
  const THREE_DIMENSIONAL = ["grains", "lift", "surfaces"];
  const drawn = [];

  const hasWebgl = once(() => ["webgl2", "webgl"].some((kind) => document.createElement("canvas").getContext(kind)));

  async function bring(figure) {
    const name = figure.dataset.view;
    const Plotly = await plotly();
    const [view, controls, plot] = [".view", ".controls", ".plot"].map((part) => figure.querySelector(part));
    view.hidden = false;
    figure.classList.add("drawn");
    try {
      const made = await KNOWN[name]({ controls, plot, Plotly });
      await made.draw();
      drawn.push(made);
      if (made.csv) {
        button(controls, "Data (CSV)", () => download(made.name(), made.csv())).setAttribute("aria-label", "Data (CSV): what is shown");
        figure.querySelector("button[data-csv]")?.remove();
      }
      figure.dataset.drawn = name;
    } catch (error) {
      view.hidden = true;
      figure.classList.remove("drawn");
      throw error;
    }
  }

  if (!("DecompressionStream" in window)) return;
  for (const node of document.querySelectorAll("button[data-csv]")) {
    node.hidden = false;
    node.onclick = async () => download(node.dataset.csv, await unpackedText(JSON.parse(text("csv-data"))[node.dataset.csv]));
  }
  const watcher = new IntersectionObserver((entries) => {
    for (const { target } of entries.filter((entry) => entry.isIntersecting)) {
      watcher.unobserve(target);
      bring(target);
    }
  }, { rootMargin: "300px" });
  for (const figure of document.querySelectorAll("figure[data-view]")) {
    if (!THREE_DIMENSIONAL.includes(figure.dataset.view) || hasWebgl()) watcher.observe(figure);
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawn.forEach((view) => view.draw()));
})();
