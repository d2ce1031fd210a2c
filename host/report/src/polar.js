"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const { circles, worst } = JSON.parse($("profiles").textContent);
  const svg = $("polar"), readout = $("readout"), pick = $("circle"), zoom = $("magnification");
  const NOMINAL = 125, REACH = 50, SECTORS = 180, NS = svg.namespaceURI;
  const KINDS = ["measured", "before", "after"];
  const checked = (name) => [...document.querySelectorAll(`input[name=${name}]:checked`)].map((i) => i.value);
  const signed = (v) => (v < 0 ? "−" : "+") + Math.abs(v).toFixed(1);
  const grouped = (v) => String(v).replace(/\B(?=(\d{3})+$)/g, "\u202f");
  let sector = 0;

  const option = (select, value, text) => {
    const o = document.createElement("option");
    o.value = value; o.textContent = text; select.append(o);
  };
  circles.forEach((c, i) => option(pick, i, c.label));
  option(zoom, "auto", "fill the ring");
  for (const m of [50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000]) option(zoom, m, `× ${grouped(m)}`);
  if (circles.length) pick.value = worst;

  const mean = (values) => {
    const known = values.filter((v) => v !== null);
    return known.reduce((a, b) => a + b, 0) / Math.max(1, known.length);
  };
  // The profile of a run with the ticked causes taken off: superposition of what the simulation says of each.
  const without = (run, off) => run.measured.map((v, k) => {
    if (v === null) return null;
    let left = v;
    for (const i of off) { const c = run.causes[i][k]; if (c !== null) left -= c; }
    return left;
  });
  const figures = (values) => {
    let low = Infinity, high = -Infinity;
    for (const v of values) if (v !== null) { low = Math.min(low, v); high = Math.max(high, v); }
    return low > high ? null : { round: high - low, size: mean(values), far: Math.max(Math.abs(low), Math.abs(high)) };
  };
  const off = () => checked("off").map(Number);
  const flat = (values) => {
    if ($("size").checked) return values;
    const m = mean(values);
    return values.map((v) => (v === null ? null : v - m));
  };

  const shown = () => {
    const circle = circles[pick.value], ways = checked("way"), curves = checked("curve"), gone = off();
    if (!circle) return { circle: null, lines: [] };
    const lines = [];
    for (const run of circle.runs) if (ways.includes(run.d)) {
      for (const kind of KINDS) if (curves.includes(kind)) lines.push({ run, kind, values: flat(run[kind]) });
      if (gone.length) lines.push({ run, kind: "whatif", values: flat(without(run, gone)) });
    }
    return { circle, lines };
  };
  const nice = (v) => { const p = 10 ** Math.floor(Math.log10(v)); return p * (v / p >= 5 ? 5 : v / p >= 2 ? 2 : 1); };
  const magnification = (circle, lines) => {
    if (zoom.value !== "auto") return Number(zoom.value);
    let most = 0.1;
    for (const l of lines) for (const v of l.values) if (v !== null) most = Math.max(most, Math.abs(v));
    const m = REACH / (most * 1e-3 * NOMINAL / circle.r), p = 10 ** Math.floor(Math.log10(m));
    // Two digits: what is worst fills the ring to a tenth.
    return Math.max(1, Math.floor(m / p * 10) / 10 * p);
  };
  const add = (name, attributes, text) => {
    const e = document.createElementNS(NS, name);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    if (text !== undefined) e.textContent = text;
    svg.append(e); return e;
  };
  let hand = null;

  const draw = () => {
    svg.replaceChildren();
    const { circle, lines } = shown();
    if (!circle) return;
    const m = magnification(circle, lines);
    // Pixels a micrometre.
    const scale = m * 1e-3 * NOMINAL / circle.r;
    const step = nice(32 / scale);
    for (let a = 0; a < 360; a += 45) {
      const [c, s] = [Math.cos(a * Math.PI / 180), Math.sin(a * Math.PI / 180)];
      add("path", { class: "grid", d: `M${(15 * c).toFixed(1)} ${(-15 * s).toFixed(1)}L${(180 * c).toFixed(1)} ${(-180 * s).toFixed(1)}` });
      add("text", { x: (190 * c).toFixed(1), y: (-190 * s + 4).toFixed(1), "text-anchor": c > 0.9 ? "end" : c < -0.9 ? "start" : "middle" }, `${a}°`);
    }
    for (let k = -4; k <= 4; k++) {
      const r = NOMINAL + k * step * scale;
      if (r < 40 || r > 178) continue;
      if (k !== 0) add("circle", { r: r.toFixed(2), class: "grid" });
    }
    add("circle", { r: NOMINAL, class: "nominal" });
    for (const { run, kind, values } of lines) {
      let d = "", pen = false;
      for (let k = 0; k <= SECTORS; k++) {
        const v = values[k % SECTORS];
        if (v === null) { pen = false; continue; }
        const r = Math.max(0, NOMINAL + v * scale), a = (2 * (k % SECTORS) + 1) * Math.PI / 180;
        d += `${pen ? "L" : "M"}${(r * Math.cos(a)).toFixed(2)} ${(-r * Math.sin(a)).toFixed(2)}`;
        pen = true;
      }
      if (d) add("path", { class: `polar-line ${run.d} ${kind}`, d });
    }
    // Labels of the rings on a ray of their own, above the curves; the full ring is zero.
    for (let k = -4; k <= 4; k++) {
      const r = NOMINAL + k * step * scale;
      if (r < 40 || r > 178) continue;
      const [x, y] = [r * Math.cos(1.1781), -r * Math.sin(1.1781)];
      add("text", { x: x.toFixed(1), y: (y + 4).toFixed(1), "text-anchor": "middle", class: k === 0 ? "label zero" : "label" },
        k === 0 ? "0 µm" : signed(k * step).replace(/\.0$/, ""));
    }
    $("shown").textContent = `${circle.label}; deviation × ${grouped(Math.round(m))}; the full ring is ${$("size").checked ? "the programmed circle" : "the mean circle"}`;
    hand = add("path", { class: "hand" });
    point(); answer();
  };

  // What the ticked causes leave: this circle, and the worst of all.
  const answer = () => {
    const gone = off(), circle = circles[pick.value], tolerance = parseFloat($("tolerance").value);
    const of = (runs, causes) => {
      const all = runs.map((run) => figures(without(run, causes))).filter((f) => f);
      return {
        round: Math.max(0, ...all.map((f) => f.round)),
        size: all.reduce((a, f) => (Math.abs(f.size) > Math.abs(a) ? f.size : a), 0),
        far: Math.max(0, ...all.map((f) => f.far)),
      };
    };
    const everything = circles.flatMap((c) => c.runs);
    const lines = [];
    // Means of 2° are smaller than the range of single samples, which the verdict gives.
    for (const [name, runs] of [["This circle, noise averaged", circle ? circle.runs : []], ["Worst of all circles", everything]]) {
      const [now, then] = [of(runs, []), of(runs, gone)];
      const change = (a, b) => (gone.length ? `${a} → ${b}` : a);
      // The mean over an arc is no radius: the form is in it.
      const arc = runs.some((run) => run.measured.filter((v) => v === null).length > SECTORS / 10);
      const size = arc ? "" : `, radius error ${change(signed(now.size), signed(then.size))} µm`;
      lines.push(`${name}: out of round ${change(now.round.toFixed(1), then.round.toFixed(1))} µm${size}`);
      if (tolerance > 0) {
        const verdict = (f) => (f.far <= tolerance ? "held" : "not held");
        lines.push(`  ±${tolerance} µm of the programmed circle: ${change(verdict(now), verdict(then))} (farthest ${change(now.far.toFixed(1), then.far.toFixed(1))} µm)`);
      }
    }
    $("answer").textContent = lines.join("\n");
  };

  const point = () => {
    const { circle, lines } = shown(), angle = 2 * sector + 1, a = angle * Math.PI / 180;
    if (!circle || !hand) return;
    hand.setAttribute("d", `M0 0L${(180 * Math.cos(a)).toFixed(1)} ${(-180 * Math.sin(a)).toFixed(1)}`);
    const parts = new Map();
    const words = { measured: "measured", before: "left before", after: "left after", whatif: "what if" };
    for (const { run, kind, values } of lines) {
      const name = `${run.d} (${run.file})`, v = values[sector];
      if (!parts.has(name)) parts.set(name, []);
      parts.get(name).push(`${words[kind]} ${v === null ? "–" : `${signed(v)} µm`}`);
    }
    const text = [...parts].map(([name, values]) => `${name}: ${values.join(", ")}`);
    readout.textContent = [`${2 * sector}° to ${2 * sector + 2}°`, ...text].join("\n");
    svg.setAttribute("aria-valuenow", 2 * sector);
    svg.setAttribute("aria-valuetext", [`${2 * sector} degrees`, ...text].join("; "));
  };
  const turn = (to) => { sector = ((to % SECTORS) + SECTORS) % SECTORS; point(); };

  svg.addEventListener("pointermove", (e) => {
    const box = svg.getBoundingClientRect();
    const x = e.clientX - box.left - box.width / 2, y = box.top + box.height / 2 - e.clientY;
    turn(Math.floor(((Math.atan2(y, x) * 180 / Math.PI + 360) % 360) / 2));
  });
  svg.addEventListener("keydown", (e) => {
    const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 15, PageDown: -15 }[e.key];
    const to = e.key === "Home" ? 0 : e.key === "End" ? SECTORS - 1 : by === undefined ? null : sector + by;
    if (to !== null) { turn(to); e.preventDefault(); }
  });
  for (const form of document.querySelectorAll("form")) {
    form.addEventListener("change", draw);
    form.addEventListener("input", draw);
    form.addEventListener("submit", (e) => e.preventDefault());
  }
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));
  draw();
})();
