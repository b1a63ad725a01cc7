// Plots of a report that zoom, drawn with uPlot from the data in the page. Nothing is loaded from anywhere.
//
// The page has two elements with data, `plots` (JSON: what to draw) and `plot-data` (the columns, deflated, in base64:
// see packed.py), and one with the attribute `data-plot` for each plot. When the plots are drawn the page gets the class
// `live`, with which the style sheet puts them in place of the still pictures.

"use strict";

(() => {
  // ---------------------------------------------------------------- data

  async function inflated(base64) {
    const bytes = Uint8Array.from(atob(base64.trim()), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Arrays of numbers; null in gaps, where uPlot breaks a line.
  function unpacked(bytes, columns) {
    let place = 0;
    return columns.map(({ n, step, offset, order, gaps }) => {
      const whole = new Int32Array(n);
      for (let k = 0; k < n; k++) {
        whole[k] = bytes[place + k] | (bytes[place + n + k] << 8)
          | (bytes[place + 2 * n + k] << 16) | (bytes[place + 3 * n + k] << 24);
      }
      place += 4 * n;
      for (let times = 0; times < order; times++) {
        for (let k = 1; k < n; k++) whole[k] = (whole[k] + whole[k - 1]) | 0;
      }
      const values = Array.from(whole, (one) => offset + step * one);
      if (gaps) {
        for (let k = 0; k < n; k++) {
          if (!((bytes[place + (k >> 3)] >> (k & 7)) & 1)) values[k] = null;
        }
        place += (n + 7) >> 3;
      }
      return values;
    });
  }

  const plus = (first, second) => first.map((one, k) => (one === null || second[k] === null ? null : one + second[k]));

  // Mean over a window of the values in it, null where there is none.
  function movingMean(values, width) {
    if (width < 2) return values;
    const before = width >> 1, after = width - before;
    let sum = 0, count = 0;
    const add = (k, sign) => {
      if (k < 0 || k >= values.length || values[k] === null) return;
      sum += sign * values[k];
      count += sign;
    };
    for (let k = 0; k < after; k++) add(k, 1);
    return values.map((one, k) => {
      const mean = one === null || count === 0 ? null : sum / count;
      add(k + after, 1);
      add(k - before, -1);
      return mean;
    });
  }

  // Index of the first element of sorted values that is at least `at`.
  function firstFrom(values, at) {
    let low = 0, high = values.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (values[middle] < at) low = middle + 1; else high = middle;
    }
    return low;
  }

  // ---------------------------------------------------------------- words and elements

  // Three significant digits, zeros at the end too, with a true minus sign.
  function numeral(value) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2)
      : size === 0 ? "0" : size >= 100 ? value.toFixed(0) : value.toPrecision(3);
    return text.replace(/-/g, "−");
  }

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name in made && typeof value === "function") made[name] = value; else made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  }

  const button = (text, label, onclick) => element("button", { type: "button", "aria-label": label, title: label, onclick }, text);

  // A button that stays pressed; `pressed` is called with its new state.
  function toggle(content, label, isOn, pressed) {
    const made = element("button", { type: "button", "aria-pressed": String(isOn), title: label }, ...content);
    made.onclick = () => {
      const now = made.getAttribute("aria-pressed") !== "true";
      made.setAttribute("aria-pressed", String(now));
      pressed(now);
    };
    return made;
  }

  const swatch = (colour) => element("i", { class: "swatch", style: `background: var(${colour})` });

  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  function faded(name, share) {
    return colour(name) + Math.round(255 * share).toString(16).padStart(2, "0");
  }

  // ---------------------------------------------------------------- zoom, by mouse, buttons and keys

  // What several plots with one horizontal axis show of it: `range` [low, high], and `height` where a drag set one.
  class View {
    constructor(low, high, changed) {
      if (!(high > low)) [low, high] = [low - 0.5, low + 0.5];  // a single sample
      this.whole = [low, high];
      this.range = [low, high];
      this.height = null;
      this.changed = changed;
    }

    show(low, high, height = this.height) {
      const [first, last] = this.whole, least = 1e-6 * (last - first);
      const width = Math.min(Math.max(high - low, least), last - first);
      const start = Math.min(Math.max(0.5 * (low + high - width), first), last - width);
      this.range = [start, start + width];
      this.height = height;
      this.changed();
    }

    zoom(factor, at = 0.5) {
      const [low, high] = this.range, pivot = low + at * (high - low);
      this.show(pivot - factor * (pivot - low), pivot + factor * (high - pivot));
    }

    pan(share) {
      const [low, high] = this.range, by = share * (high - low);
      this.show(low + by, high + by);
    }

    reset() {
      this.show(...this.whole, null);
    }
  }

  function zoomButtons(view) {
    return element("span", { class: "buttons", role: "group", "aria-label": "zoom" },
      button("+", "zoom in", () => view.zoom(0.5)),
      button("−", "zoom out", () => view.zoom(2)),
      button("◂", "earlier or lower", () => view.pan(-0.25)),
      button("▸", "later or higher", () => view.pan(0.25)),
      button("reset", "show everything", () => view.reset()));
  }

  // Keys of a plot that has the focus; `move(step)` moves its cursor, `choose(step)` the line it names.
  function listenToKeys(host, view, move, choose = () => {}) {
    host.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || event.target !== host) return;
      const far = event.shiftKey ? 10 : 1;
      const actions = {
        "+": () => view.zoom(0.5), "=": () => view.zoom(0.5), "-": () => view.zoom(2), "0": () => view.reset(),
        Escape: () => view.reset(), PageUp: () => view.pan(-0.5), PageDown: () => view.pan(0.5),
        ArrowLeft: () => move(-far), ArrowRight: () => move(far),
        ArrowUp: () => choose(-1), ArrowDown: () => choose(1),
      };
      if (event.key in actions) {
        event.preventDefault();
        actions[event.key]();
      }
    });
  }

  // The next index that the cursor goes to, within what is shown.
  function stepped(x, view, index, steps) {
    const first = firstFrom(x, view.range[0]), last = Math.max(firstFrom(x, view.range[1]), first + 1) - 1;
    if (index === null || index === undefined || index < first || index > last) return (first + last) >> 1;
    const width = Math.max(1, Math.round((last - first) / 200));
    return Math.min(Math.max(index + steps * width, first), last);
  }

  // ---------------------------------------------------------------- uPlot with this page's colours

  function axis(side, label, more = {}) {
    return {
      side, label, stroke: () => colour("--ink"), font: "12px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif", labelSize: side === 2 ? 18 : 20, labelGap: 0,
      grid: { stroke: () => colour("--line"), width: 1 }, ticks: { stroke: () => colour("--line"), width: 1, size: 4 },
      values: (_, ticks) => ticks.map((one) => (one === null ? "" : plainTick(one))),
      ...(side === 2 ? { size: 28, space: 38 } : { size: 56 }),
      ...more,
    };
  }

  const plainTick = (value) => {
    const size = Math.abs(value);
    const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(0) : String(Number(value.toPrecision(6)));
    return text.replace(/-/g, "−");
  };

  // Of the ticks of a logarithmic axis those at 1, 2 and 5; its ends, where uPlot puts one too, are any number.
  const roundTicks = (_, ticks) => ticks.map((one) => {
    const first = one === null ? 0 : Number((one / 10 ** Math.floor(Math.log10(one) + 1e-9)).toPrecision(4));
    return [1, 2, 5].includes(first) ? plainTick(one) : "";
  });

  // A uPlot in `host`: dragged along x or y or both it zooms the view; ranges are given, never found by uPlot.
  function newPlot(host, view, { height, series, axes, data, key, logarithmic = [false, false], hooks = {}, focus = false }) {
    const scale = (index) => ({ time: false, auto: false, distr: logarithmic[index] ? 3 : 1, range: (_, low, high) => [low, high] });
    const plot = new uPlot({
      width: Math.max(host.clientWidth, 50), height, series, axes, legend: { show: false },
      scales: { x: scale(0), y: scale(1) },
      padding: [6, 10, 0, 0],
      cursor: {
        sync: { key, setSeries: focus, scales: ["x", null], filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
        drag: { x: true, y: true, uni: 30, setScale: false },
        points: { size: 6 },
        ...(focus ? { focus: { prox: 24 } } : {}),
        bind: { dblclick: () => () => { view.reset(); return null; } },
      },
      ...(focus ? { focus: { alpha: 1 } } : {}),
      hooks: {
        ...hooks,
        setSelect: [(self) => {
          const { left, top, width, height: tall } = self.select;
          if (width < 3 && tall < 3) return;
          const all = tall >= self.over.clientHeight - 1, across = width >= self.over.clientWidth - 1;
          const range = across ? view.range : [self.posToVal(left, "x"), self.posToVal(left + width, "x")];
          const tallness = all ? view.height : [self.posToVal(top + tall, "y"), self.posToVal(top, "y")];
          self.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          view.show(...range, tallness);
        }],
      },
    }, data, host);
    return plot;
  }

  function setRanges(plot, [low, high], [bottom, top]) {
    plot.batch(() => {
      plot.setScale("x", { min: low, max: high });
      plot.setScale("y", { min: bottom, max: top });
    });
  }

  // Lowest and highest value of lines between two indices.
  function extent(lines, first, last) {
    let low = Infinity, high = -Infinity;
    for (const values of lines) {
      for (let k = first; k <= last; k++) {
        const one = values[k];
        if (one !== null && one !== undefined) {
          if (one < low) low = one;
          if (one > high) high = one;
        }
      }
    }
    return [low, high];
  }

  function spread([low, high]) {
    if (!(high >= low)) return [-1, 1];
    const margin = 0.06 * (high - low) || Math.abs(high) || 1;
    return [low - margin, high + margin];
  }

  // Calls `fit(width)` when the element gets another width.
  function onWidth(host, fit) {
    let last = host.clientWidth;
    new ResizeObserver(() => requestAnimationFrame(() => {
      const width = host.clientWidth;
      if (width && width !== last) {
        last = width;
        fit(width);
      }
    })).observe(host);
  }

  const KEYS = "Keys: arrows left and right move the cursor, + and − zoom, Page Up and Page Down pan, 0 shows everything.";

  // ---------------------------------------------------------------- residuals over time, a panel per channel

  class ResidualPlot {
    constructor(host, spec, columns) {
      this.host = host;
      this.spec = spec;
      this.x = columns[spec.x.column];
      this.columns = columns;
      this.cache = new Map();
      this.shown = new Set(spec.shown);
      this.lines = { before: true, after: true, samples: true, mean: true };
      this.drive = columns[spec.drive.column];
      this.withDrive = false;
      this.sameScale = true;
      this.panels = [];
      this.view = new View(this.x[0], this.x[this.x.length - 1], () => this.fit());
      this.readout = element("span", { class: "readout" });
      this.panelHost = element("div", {
        class: "panels", tabindex: "0", role: "group", "aria-roledescription": "plot",
        "aria-label": `Residuals over time, before and after. ${KEYS}`,
      });
      this.host.append(this.toolbar(), this.channelBar(), this.panelHost);
      listenToKeys(this.panelHost, this.view, (steps) => this.moveCursor(steps));
      this.build();
      onWidth(this.panelHost, (width) => this.panels.forEach(({ plot }) => plot.setSize({ width, height: plot.height })));
    }

    data(channel) {
      if (!this.cache.has(channel)) {
        const spec = this.spec.channels[channel], read = (name) => this.columns[spec[name]];
        const before = read("before"), after = "change" in spec ? plus(before, read("change")) : read("after");
        const mean = (values, name) => movingMean(name in spec ? read(name) : values, this.spec.smooth);
        this.cache.set(channel, { before, after, meanBefore: mean(before, "mean_before"), meanAfter: mean(after, "mean_after") });
      }
      return this.cache.get(channel);
    }

    toolbar() {
      const line = (name, colourName, text) => toggle([swatch(colourName), text], `show ${text}`, true, (on) => {
        this.lines[name] = on;
        this.showLines();
      });
      return element("div", { class: "toolbar" },
        zoomButtons(this.view),
        element("span", { class: "buttons", role: "group", "aria-label": "lines" },
          line("before", "--before", "before"), line("after", "--after", "after"),
          toggle(["samples"], this.spec.grouped ? "show lowest and highest values" : "show the samples", true, (on) => { this.lines.samples = on; this.showLines(); }),
          toggle(["mean"], "show the moving mean", true, (on) => { this.lines.mean = on; this.showLines(); }),
          toggle(["same scale"], "one vertical scale for all channels", true, (on) => { this.sameScale = on; this.view.height = null; this.fit(); }),
          toggle([this.spec.drive.label], `show the ${this.spec.drive.label}`, false, (on) => { this.withDrive = on; this.build(); })),
        this.readout);
    }

    channelBar() {
      const choose = (channels) => () => {
        this.shown = new Set(channels);
        this.toggles.forEach((one, channel) => one.setAttribute("aria-pressed", String(this.shown.has(channel))));
        this.build();
      };
      this.toggles = this.spec.channels.map((channel, number) => toggle(
        [swatch(`--chip-${channel.chip}`), channel.name], `channel ${channel.name}`, this.shown.has(number), (on) => {
          if (on) this.shown.add(number); else this.shown.delete(number);
          this.build();
        }));
      return element("div", { class: "toolbar channels", role: "group", "aria-label": "channels" },
        button("strongest", "show the channels furthest above their noise", choose(this.spec.shown)),
        button("all", "show all channels", choose(this.spec.channels.keys())),
        button("none", "show no channel", choose([])), ...this.toggles);
    }

    build() {
      this.panels.forEach(({ plot }) => plot.destroy());
      this.panelHost.replaceChildren();
      const channels = [...this.shown].sort((first, second) => first - second);
      const height = channels.length > 6 ? 92 : channels.length > 1 ? 130 : 240;
      this.panels = channels.map((channel, place) => this.channelPanel(channel, height, !this.withDrive && place === channels.length - 1));
      if (this.withDrive) this.panels.push(this.drivePanel(110));
      if (!this.panels.length) this.panelHost.append(element("p", { class: "small quiet" }, "No channel is chosen."));
      this.showLines();
      this.fit();
      this.say();
    }

    channelPanel(channel, height, isLast) {
      const spec = this.spec.channels[channel], found = this.data(channel);
      const words = element("span", { class: "values" });
      const box = element("div", { class: "panel" },
        element("div", { class: "head" }, element("b", {}, swatch(`--chip-${spec.chip}`), spec.name), words));
      this.panelHost.append(box);
      const thin = (name) => ({ stroke: () => faded(name, 0.28), width: 1, points: { show: false }, spanGaps: false });
      const bold = (name) => ({ stroke: () => colour(name), width: 2, points: { show: false } });
      const plot = newPlot(box, this.view, {
        height: height + (isLast ? 46 : 0), key: "residual",
        data: [this.x, found.before, found.after, found.meanBefore, found.meanAfter],
        series: [{}, thin("--before"), thin("--after"), bold("--before"), bold("--after")],
        axes: [axis(2, isLast ? this.spec.x.label : null, isLast ? {} : { size: 4, values: (_, ticks) => ticks.map(() => "") }), axis(3, this.spec.unit)],
        hooks: { drawClear: [(self) => drawBand(self, spec.noise)], setCursor: [() => this.say()] },
      });
      return { plot, words, spec, found, channel };
    }

    drivePanel(height) {
      const { label, unit } = this.spec.drive, words = element("span", { class: "values" });
      const box = element("div", { class: "panel" }, element("div", { class: "head" }, element("b", {}, label), words));
      this.panelHost.append(box);
      const plot = newPlot(box, this.view, {
        height: height + 46, key: "residual", data: [this.x, this.drive],
        series: [{}, { stroke: () => colour("--ink"), width: 1.4, points: { show: false } }],
        axes: [axis(2, this.spec.x.label), axis(3, unit)], hooks: { setCursor: [() => this.say()] },
      });
      return { plot, words, drive: true };
    }

    showLines() {
      const { before, after, samples, mean } = this.lines;
      for (const { plot, drive } of this.panels) {
        if (drive) continue;
        [before && samples, after && samples, before && mean, after && mean].forEach((show, k) => plot.setSeries(k + 1, { show }));
      }
      this.fit();
    }

    fit() {
      const [low, high] = this.view.range;
      const first = Math.max(firstFrom(this.x, low) - 1, 0), last = Math.min(firstFrom(this.x, high), this.x.length - 1);
      const drawn = ({ plot }) => plot.data.slice(1).filter((_, k) => plot.series[k + 1].show);
      const channels = this.panels.filter(({ drive }) => !drive);
      const shared = this.sameScale ? spread(extent(channels.flatMap(drawn), first, last)) : null;
      for (const panel of this.panels) {
        const own = panel.drive || !shared ? spread(extent(drawn(panel), first, last)) : shared;
        setRanges(panel.plot, [low, high], panel.drive ? own : this.view.height ?? own);
      }
      this.host.dataset.range = `${low} ${high}`;
    }

    moveCursor(steps) {
      const panel = this.panels[0];
      if (!panel) return;
      const index = stepped(this.x, this.view, panel.plot.cursor.idx, steps);
      panel.plot.setCursor({ left: panel.plot.valToPos(this.x[index], "x"), top: panel.plot.over.clientHeight / 2 });
    }

    // Values at the cursor in the head of every panel; without a cursor the rms of the whole run.
    say() {
      const index = this.panels.length ? this.panels[0].plot.cursor.idx : null;
      const known = index !== null && index !== undefined;
      this.readout.textContent = known ? `t = ${Number(this.x[index].toFixed(4))} s` : "";
      for (const { words, spec, found, drive } of this.panels) {
        if (drive) {
          words.textContent = known ? `${numeral(this.drive[index])} ${this.spec.drive.unit}` : "";
          continue;
        }
        const pair = known ? [this.at(found.before, index), this.at(found.after, index)] : spec.rms.map(numeral);
        words.replaceChildren(known ? "" : "rms: ", swatch("--before"), `before ${pair[0]} `, swatch("--after"), `after ${pair[1]} ${this.spec.unit}`);
      }
    }

    // The value, or lowest and highest of a group of samples.
    at(values, index) {
      if (!this.spec.grouped) return numeral(values[index]);
      const first = index - (index % 2);
      return `${numeral(values[first])} to ${numeral(values[first + 1])}`;
    }
  }

  // Noise, ±2σ, behind the lines.
  function drawBand(self, noise) {
    if (!noise) return;
    const { ctx, bbox } = self;
    const [top, bottom] = [2 * noise, -2 * noise].map((one) => Math.min(Math.max(self.valToPos(one, "y", true), bbox.top), bbox.top + bbox.height));
    ctx.save();
    ctx.fillStyle = faded("--band", 0.5);
    ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    ctx.restore();
  }

  // ---------------------------------------------------------------- spectrum

  class SpectrumPlot {
    constructor(host, spec, columns, key) {
      this.spec = spec;
      const power = (values) => values.map((one) => (one === null ? null : 10 ** one));
      const all = columns[spec.x.column], kept = all.map((at, k) => k).filter((k) => !spec.x.logarithmic || all[k] > 0);
      this.x = kept.map((k) => all[k]);
      this.lines = Object.fromEntries(Object.entries(spec.lines).map(([name, column]) => {
        const values = power(columns[column]);
        return [name, kept.map((k) => values[k])];
      }));
      this.view = new View(this.x[0], this.x[this.x.length - 1], () => this.fit());
      if (spec.x.logarithmic) this.onLogarithms();
      this.readout = element("span", { class: "readout" });
      const box = element("div", {
        class: "panel", tabindex: "0", role: "group", "aria-roledescription": "plot",
        "aria-label": `Spectrum of the residual before and after, beside noise. ${KEYS}`,
      });
      const line = (name, number) => toggle([swatch(`--${name}`), name], `show ${name}`, true, (show) => {
        this.plot.setSeries(number, { show });
        this.fit();
      });
      host.append(element("div", { class: "toolbar" }, zoomButtons(this.view),
        element("span", { class: "buttons", role: "group", "aria-label": "lines" }, line("before", 2), line("after", 3), line("noise", 1)), this.readout), box);
      box.append(element("div", { class: "head" }, element("b", {}, spec.label)));
      listenToKeys(box, this.view, (steps) => {
        const index = stepped(this.x, this.view, this.plot.cursor.idx, steps);
        this.plot.setCursor({ left: this.plot.valToPos(this.x[index], "x"), top: this.plot.over.clientHeight / 2 });
      });
      const style = (name, more = {}) => ({ stroke: () => colour(`--${name}`), width: 1.3, points: { show: false }, ...more });
      this.plot = newPlot(box, this.view, {
        height: 230, key, logarithmic: [spec.x.logarithmic, true],
        data: [this.x, this.lines.noise, this.lines.before, this.lines.after],
        series: [{}, style("noise", { dash: [6, 4] }), style("before"), style("after")],
        axes: [axis(2, spec.x.label, spec.x.logarithmic ? { values: roundTicks } : {}), axis(3, null, { values: roundTicks })],
        hooks: { setCursor: [() => this.say()] },
      });
      onWidth(box, (width) => this.plot.setSize({ width, height: this.plot.height }));
      this.fit();
      this.say();
    }

    // Zoom and pan by equal steps of the logarithm.
    onLogarithms() {
      const { view } = this, logarithms = () => view.range.map(Math.log);
      view.zoom = (factor) => {
        const [low, high] = logarithms(), middle = 0.5 * (low + high);
        view.between(middle - 0.5 * factor * (high - low), middle + 0.5 * factor * (high - low));
      };
      view.pan = (share) => {
        const [low, high] = logarithms(), by = share * (high - low);
        view.between(low + by, high + by);
      };
      view.between = (low, high) => {
        const [first, last] = view.whole.map(Math.log), width = Math.min(high - low, last - first);
        const start = Math.min(Math.max(0.5 * (low + high - width), first), last - width);
        view.range = [Math.exp(start), Math.exp(start + width)];
        view.changed();
      };
    }

    fit() {
      if (!this.plot) return;
      const [low, high] = this.view.range;
      const shown = this.plot.data.slice(1).filter((_, k) => this.plot.series[k + 1].show);
      let [bottom, top] = extent(shown, firstFrom(this.x, low * (1 - 1e-9)), Math.min(firstFrom(this.x, high), this.x.length - 1));
      if (!(top >= bottom)) [bottom, top] = [0.1, 1];
      setRanges(this.plot, [low, high], this.view.height ?? [bottom / 1.3, top * 1.3]);
    }

    say() {
      if (!this.plot) return;
      const index = this.plot.cursor.idx, known = index !== null && index !== undefined;
      const { name, unit } = this.spec.x, value = (line) => numeral(this.lines[line][index]);
      this.readout.textContent = known
        ? `${name} = ${numeral(this.x[index])} ${unit}: before ${value("before")}, after ${value("after")}, noise ${value("noise")} ${this.spec.unit}` : "";
    }
  }

  // ---------------------------------------------------------------- start

  const KINDS = { residual: ResidualPlot, spectrum: SpectrumPlot };

  async function start() {
    const spec = JSON.parse(document.getElementById("plots").textContent);
    const columns = unpacked(await inflated(document.getElementById("plot-data").textContent), spec.columns);
    const root = document.documentElement;
    root.classList.add("live");  // an element that is not shown has no width to draw in
    const drawn = new Map();
    const draw = (host) => {
      if (drawn.has(host) || !host.clientWidth) return;
      const name = host.dataset.plot, one = spec.plots[name];
      drawn.set(host, new KINDS[one.kind](host, one, columns, name));
    };
    try {
      document.querySelectorAll("[data-plot]").forEach(draw);
    } catch (error) {
      root.classList.remove("live");  // the still pictures stay
      throw error;
    }
    // Plots inside <details> get a width when it opens.
    document.querySelectorAll("details").forEach((one) => one.addEventListener("toggle", () => one.querySelectorAll("[data-plot]").forEach(draw)));
    const redraw = () => drawn.forEach((one) => (one.panels ?? one.plots ?? [one]).forEach((part) => (part.plot ?? part).redraw(false)));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    root.dataset.ready = "true";
  }

  // What is folded is printed too.
  addEventListener("beforeprint", () => document.querySelectorAll("details:not([open])").forEach((one) => {
    one.dataset.folded = "true";
    one.open = true;
  }));
  addEventListener("afterprint", () => document.querySelectorAll("details[data-folded]").forEach((one) => {
    delete one.dataset.folded;
    one.open = false;
  }));

  if (document.getElementById("plots") && typeof DecompressionStream === "function") start();
})();
