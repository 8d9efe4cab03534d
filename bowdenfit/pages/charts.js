"use strict";
// Charts of this page: drag to zoom, hover or arrow keys to read values; without this script the drawings stand in their place.
(() => {
  const BAND = 0.25, INNER_BAR = 0.45, NEAR = 12, STEP = 1.6;
  const WHOLE = [0, 1, 2, 3, 4, 5].flatMap(power => [1, 2, 5].map(digit => digit * 10 ** power)); // between marks of what is counted
  const SHORTEST = 4, LETTER = 0.47, MARGIN = 5.6; // letters of a name; widths [rem] of a letter, and beside the panel
  const make = (tag, parent, given = {}) => parent.appendChild(Object.assign(document.createElement(tag), given));
  const color = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || name;
  const shown = value => typeof value === "string" ? value : String(Number(value.toPrecision(4)));
  const rem = () => parseFloat(getComputedStyle(document.documentElement).fontSize);
  const font = () => `${Math.round(0.8 * rem())}px system-ui, sans-serif`;
  const padded = (low, high) => { const room = 0.04 * (high - low) || 0.1 * Math.abs(low) || 1; return [low - room, high + room]; };
  const isBar = one => one.look === "from" || one.look === "to";

  function seriesOf(chart) {
    const all = chart.groups.flatMap(group => group.series);
    return all.map((one, i) => ({ ...one, partner: one.look === "high" ? i : one.look === "low" ? i + 2 : null }));
  }

  function looks(one) {
    const stroke = color(one.color);
    if (one.look === "points" || one.look === "hollow")
      return { paths: () => null, stroke, points: { show: true, size: 7, fill: one.look === "points" ? stroke : color("paper") } };
    if (isBar(one)) return { paths: () => null, points: { show: false } };
    if (one.look === "low" || one.look === "high") return { stroke: "transparent", points: { show: false } };
    return { stroke, width: 2, dash: one.look === "dashed" ? [6, 4] : undefined, points: { show: false } };
  }

  function shade(plot, spans) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const span of spans) {
      const from = plot.valToPos(span.start, "x", true), to = plot.valToPos(span.stop, "x", true);
      ctx.fillStyle = color(span.color);
      ctx.fillRect(from, bbox.top, Math.max(to - from, 2), bbox.height);
    }
    ctx.restore();
  }

  // Upright bars from one edge to the other: the longest thin, those inside of it thick.
  function drawBars(plot, series) {
    const { ctx, bbox } = plot, within = {};
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    series.forEach((one, i) => {
      if (one.look !== "from") return;
      const isInner = one.color in within;
      within[one.color] = true;
      ctx.strokeStyle = color(one.color);
      ctx.globalAlpha = isInner ? INNER_BAR : 1;
      ctx.lineWidth = (isInner ? 6 : 2) * devicePixelRatio;
      ctx.beginPath();
      plot.data[0].forEach((x, k) => {
        const [from, to] = [plot.data[i + 1][k], plot.data[i + 2][k]];
        if (from == null || to == null) return;
        const across = plot.valToPos(x, "x", true);
        ctx.moveTo(across, plot.valToPos(from, "y", true));
        ctx.lineTo(across, plot.valToPos(to, "y", true));
      });
      ctx.stroke();
    });
    ctx.restore();
  }

  // What stands below places that have names: as much of each as there is room for, or its number.
  function nameSplits(plot, splits, names) {
    const room = Math.floor((plot.width - MARGIN * rem()) / Math.max(splits.length, 1) / (LETTER * rem())) - 1;
    const short = name => name.length <= room ? name : room > SHORTEST ? `${name.slice(0, room - 1)}\u2026` : null;
    const texts = splits.map(place => short(names[place - 1] ?? ""));
    return texts.includes(null) ? splits.map(place => names[place - 1] === undefined ? "" : String(place)) : texts;
  }

  // The nearest place at which a line has a value; of points only one close to the pointer.
  function place(plot, number, hovered, series) {
    const values = plot.data[number], at = plot.cursor.left, x = plot.data[0];
    const there = i => i >= 0 && i < x.length && values[i] != null;
    let near = hovered;
    for (let step = 0; step < x.length && !there(near); step++) near = there(hovered - step) ? hovered - step : hovered + step;
    const isPoint = ["points", "hollow", "from", "to"].includes(series[number - 1].look);
    return there(near) && (!isPoint || Math.abs(plot.valToPos(x[near], "x") - at) < NEAR) ? near : null;
  }

  class Chart {
    constructor(box) {
      this.box = box;
      this.charts = JSON.parse(box.querySelector(".numbers").textContent);
      this.drawing = box.parentElement.querySelector(".drawing");
      this.current = 0;
      this.tools = make("div", box, { className: "tools" });
      if (this.charts.length > 1) this.addChoice();
      for (const [words, name, act] of [
        ["Zoom in", "+", () => this.zoom(1 / STEP)], ["Zoom out", "\u2212", () => this.zoom(STEP)], ["Show all", "All", () => this.whole()],
      ]) make("button", this.tools, { type: "button", textContent: name, title: words, ariaLabel: words, onclick: act });
      this.swap = make("button", this.tools, { type: "button", className: "swap", onclick: () => this.show(this.area.hidden) });
      this.swap.hidden = !this.drawing.firstElementChild;
      this.area = make("div", box, { className: "area", tabIndex: 0 });
      this.area.setAttribute("role", "application");
      this.area.setAttribute("aria-label", "Chart. Left and right arrow read values, plus and minus zoom, zero shows all.");
      this.area.addEventListener("keydown", event => this.key(event));
      this.key_ = make("dl", box, { className: "key" });
      this.key_.setAttribute("aria-live", "polite");
      box.hidden = box.closest("figure").hidden = false;
      this.show(true);
      new ResizeObserver(() => this.fit()).observe(box);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    }

    addChoice() {
      const label = make("label", this.tools, { textContent: "Show " });
      const choice = make("select", label);
      this.charts.forEach((chart, i) => make("option", choice, { value: i, textContent: chart.name }));
      choice.onchange = () => { this.current = Number(choice.value); this.draw(); };
    }

    show(chart) {
      this.area.hidden = this.key_.hidden = !chart;
      this.drawing.classList.toggle("replaced", chart);
      this.swap.textContent = chart ? "Printed figure" : "Chart to zoom";
      for (const button of this.tools.querySelectorAll("button:not(.swap), label")) button.hidden = !chart;
      if (chart) this.draw();
    }

    draw() {
      if (this.area.hidden) return;
      const chart = this.charts[this.current], series = seriesOf(chart), text = color("ink"), grid = color("rule");
      this.plot?.destroy();
      const tables = chart.groups.map(group => [group.x, ...group.series.map(one => one.values)]);
      const data = uPlot.join(tables, tables.map(table => table.map(() => 2)));
      const named = chart.names.length > 0, counts = data[0].every(Number.isInteger);
      const picked = chart.groups.some(group => group.series.some(one => one.keys));
      this.ends = named ? [0.5, chart.names.length + 0.5] : [data[0][0], data[0].at(-1)];
      const dotted = chart.groups.some(group => group.series.some(one => ["points", "hollow"].includes(one.look)));
      if (dotted && !named) this.ends = padded(...this.ends); // no point lies on the edge
      const axis = label => ({ label, stroke: text, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid }, font: font(), labelFont: font() });
      const bands = series.flatMap((one, i) => one.look === "low" ? [{ series: [i + 2, i + 1], fill: color(one.color) + Math.round(255 * BAND).toString(16) }] : []);
      this.addKey(chart, series);
      this.plot = new uPlot({
        ...this.size(),
        legend: { show: false },
        scales: { x: { time: false } },
        axes: [{ ...axis(chart.x), ...(counts ? { incrs: WHOLE } : {}), ...(named ? { values: (plot, splits) => nameSplits(plot, splits, chart.names) } : {}) }, { ...axis(chart.y), size: 3.9 * rem() }],
        series: [{}, ...series.map(looks)],
        bands,
        cursor: { dataIdx: (plot, number, hovered) => number === 0 ? hovered : place(plot, number, hovered, series), drag: { x: true, y: false } },
        hooks: {
          drawClear: [plot => shade(plot, chart.spans)],
          drawAxes: [plot => drawBars(plot, series)],
          setCursor: [plot => this.read(plot, series)],
          setScale: [(plot, name) => { if (name === "x") this.box.dataset.shown = `${plot.scales.x.min} ${plot.scales.x.max}`; }],
        },
      }, data, this.area);
      if (named || dotted) this.whole();
      if (picked) this.plot.over.addEventListener("click", event => this.pick(event, chart));
    }

    addKey(chart, series) {
      this.key_.replaceChildren();
      this.values = new Map();
      const within = {}; // how many bands of a color lie over each other, the widest first
      const entry = (label, one) => {
        if (this.values.has(label)) return;
        const row = make("div", this.key_);
        const name = make("dt", row);
        const mark = make("span", name, { className: `mark ${one.look ?? (one.start === one.stop ? "upright" : "span")}` });
        mark.style.color = color(one.color);
        const place = ["low", "from"].includes(one.look) ? within[one.color + one.look] = (within[one.color + one.look] ?? 0) + 1 : 0;
        if (one.look === "low") mark.style.opacity = 1 - (1 - BAND) ** place;
        if (one.look === "from" && place > 1) mark.classList.add("inner");
        make("span", name, { textContent: label });
        this.values.set(label, make("dd", row));
      };
      entry(chart.x, { look: "place", color: "muted" });
      series.forEach(one => entry(one.label, one));
      chart.spans.forEach(span => entry(span.label, span));
    }

    read(plot, series) {
      const at = plot.cursor.idx, found = new Map();
      const bands = new Set(series.filter(one => !["points", "hollow"].includes(one.look)).map(one => one.label));
      if (at != null) {
        const x = plot.data[0][at], { names } = this.charts[this.current];
        found.set(this.charts[this.current].x, [names.length ? names[x - 1] : x]);
        for (const span of this.charts[this.current].spans)
          if (span.start === span.stop) found.set(span.label, [span.start]);
          else if (span.start <= plot.data[0][at] && plot.data[0][at] <= span.stop) found.set(span.label, null);
        series.forEach((one, i) => {
          const where = plot.cursor.idxs[i + 1];
          if (where != null) found.set(one.label, [...(found.get(one.label) ?? []), plot.data[i + 1][where]]);
        });
      }
      for (const [label, cell] of this.values) {
        const values = found.get(label);
        cell.textContent = !found.has(label) ? "" : values === null ? "here" : values.map(shown).join(bands.has(label) ? " to " : ", ");
      }
    }

    // A point that is clicked says what it is called; whoever made the page may listen.
    pick(event, chart) {
      const box = this.plot.over.getBoundingClientRect(), [left, top] = [event.clientX - box.left, event.clientY - box.top];
      let nearest = NEAR, key = null;
      for (const group of chart.groups)
        for (const one of group.series.filter(one => one.keys))
          group.x.forEach((x, i) => {
            const away = one.values[i] == null ? Infinity : Math.hypot(this.plot.valToPos(x, "x") - left, this.plot.valToPos(one.values[i], "y") - top);
            if (away < nearest) [nearest, key] = [away, one.keys[i]];
          });
      if (key) this.box.dispatchEvent(new CustomEvent("pick", { bubbles: true, detail: key }));
    }

    size() {
      return { width: Math.max(this.box.clientWidth - 2, 240), height: Math.round(Math.min(Math.max(this.box.clientWidth * 0.5, 260), 26 * rem())) };
    }

    fit() {
      const { width, height } = this.size();
      if (this.plot && !this.area.hidden && (width !== this.plot.width || height !== this.plot.height)) this.plot.setSize({ width, height });
    }

    zoom(factor) {
      const { min, max } = this.plot.scales.x, read = this.plot.cursor.idx;
      const middle = read == null ? (min + max) / 2 : this.plot.data[0][read];
      const low = Math.max(middle - (middle - min) * factor, this.ends[0]), high = Math.min(middle + (max - middle) * factor, this.ends[1]);
      if (high > low) this.plot.setScale("x", { min: low, max: high });
    }

    whole() { this.plot.setScale("x", { min: this.ends[0], max: this.ends[1] }); }

    step(by) {
      const x = this.plot.data[0], { min, max } = this.plot.scales.x;
      let next = (this.plot.cursor.idx ?? x.findIndex(value => value >= (min + max) / 2)) + by;
      next = Math.min(Math.max(next, x.findIndex(value => value >= min)), x.findLastIndex(value => value <= max));
      this.plot.setCursor({ left: this.plot.valToPos(x[next], "x"), top: this.plot.over.clientHeight / 2 });
    }

    key(event) {
      const act = { ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), "+": () => this.zoom(1 / STEP), "=": () => this.zoom(1 / STEP), "-": () => this.zoom(STEP), 0: () => this.whole(), Escape: () => this.whole() }[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act();
    }
  }

  // Whoever puts charts on a page later calls this again; those that are drawn are no longer hidden.
  globalThis.drawCharts = () => document.querySelectorAll(".chart[hidden]").forEach(box => new Chart(box));
  drawCharts();
})();
