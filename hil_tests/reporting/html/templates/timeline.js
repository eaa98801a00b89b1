// The bus of one test as a timeline: lanes of states and of frames, zoomed and walked through by
// mouse and keyboard. Its data lie deflated in the page and are unpacked when it comes into view.
(() => {
  const NAMES = 200, AXIS = 26, ROW = 22, NEAR = 7, LEAST_NS = 2000;
  const BAD = new Set(['failed', 'inconclusive', 'observation', 'error']);
  const COLOURS = ['ink', 'dim', 'rule', 'card', 'sunk', 'sent', 'seen', 'stimulus', 'hatch', 'focus',
    'passed', 'passed-soft', 'failed', 'failed-soft', 'inconclusive', 'inconclusive-soft',
    'observation', 'observation-soft', 'idle', 'idle-soft', 'error'];
  const STATES = { on: 'passed', off: 'idle', held: 'stimulus', lit: 'inconclusive', rate: 'idle',
    boot: 'observation', pre: 'inconclusive', operational: 'passed', stopped: 'failed', strange: 'failed' };

  // Numbers for people.

  const seconds = (ns, digits = 6) => (ns < 0 ? '−' : '') + (Math.abs(ns) / 1e9).toFixed(digits);
  const span = (ns) => {
    const size = Math.abs(ns);
    const [unit, scale] = size >= 1e10 ? ['s', 1e9] : size >= 1e6 ? ['ms', 1e6] : size >= 1e3 ? ['µs', 1e3] : ['ns', 1];
    return `${+(ns / scale).toFixed(3)} ${unit}`;
  };
  const interval = ([low, high]) => (low === high ? span(low) : `${span(low)} – ${span(high)}`);
  const limits = ([low, high]) =>
    low === null ? `at most ${span(high)}` : high === null ? `at least ${span(low)}` : `${span(low)} – ${span(high)}`;

  // Unpacking.

  async function unpack(text) {
    const letters = atob(text);
    const packed = new Uint8Array(letters.length);  // Uint8Array.from takes ten times as long
    for (let place = 0; place < letters.length; place++) packed[place] = letters.charCodeAt(place);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    const raw = new Uint8Array(await new Response(stream).arrayBuffer());
    const size = new DataView(raw.buffer).getUint32(0, true);
    const bus = JSON.parse(new TextDecoder().decode(raw.subarray(4, 4 + size)));
    const count = bus.n, start = 4 + size;
    bus.at = new Float64Array(count);
    bus.kind = new Uint32Array(count);
    for (let frame = 0, now = 0; frame < count; frame++) {
      let step = 0;
      for (let plane = 5; plane >= 0; plane--) step = step * 256 + raw[start + plane * count + frame];
      now += step < 2 ** 47 ? step : step - 2 ** 48;
      bus.at[frame] = now;
      const place = start + 6 * count + frame;
      bus.kind[frame] = raw[place] + raw[place + count] * 256 + raw[place + 2 * count] * 65536;
    }
    return bus;
  }

  const element = (name, attributes = {}, ...children) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  class Timeline {
    constructor(box, bus) {
      this.box = box;
      this.bus = bus;
      this.laneOfKind = Uint16Array.from(bus.words, (word) => word[2]);
      this.end = Math.max(bus.end, 1);
      this.frame = -1;
      this.check = -1;
      this.drag = null;
      this.lanes = this.makeLanes();
      this.build();
      this.measure();
      this.all();
      const finding = bus.checks.findIndex((check) => BAD.has(check.outcome));
      if (finding >= 0) this.showCheck(finding);
      addEventListener('theme', () => this.recolour());
      matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.recolour());
      new ResizeObserver(() => this.draw()).observe(this.canvas);
    }

    // Lanes from top to bottom: checks, states, frames, and what else the bus showed.
    makeLanes() {
      const { bus } = this;
      const lanes = [];
      if (bus.checks.length) lanes.push({ name: 'checks', kind: 'checks' });
      for (const [name, spans] of bus.spans) lanes.push({ name, kind: 'state', spans });
      if (bus.moments.length) lanes.push({ name: 'bench', kind: 'moments' });
      this.first = lanes.length;
      for (const name of bus.lanes) lanes.push({ name, kind: 'frames' });
      if (bus.events.length) lanes.push({ name: 'bus events', kind: 'events' });
      return lanes;
    }

    build() {
      const number = this.box.dataset.test;
      this.canvas = element('canvas', { tabindex: '0', role: 'application', 'aria-describedby': `k${number}`,
        'aria-label': `Bus timeline of test ${number}: ${this.bus.n} frames, ${this.lanes.length} lanes` });
      this.said = element('p', { class: 'said', role: 'status' }, 'Nothing is selected.');
      this.rows = element('tbody');
      const button = (text, label, act) => {
        const made = element('button', { type: 'button', class: 'plain', 'aria-label': label, title: label }, text);
        made.addEventListener('click', act);
        return made;
      };
      const tools = element('div', { class: 'tools' },
        button('−', 'Zoom out', () => this.zoom(2)), button('+', 'Zoom in', () => this.zoom(0.5)),
        button('All', 'All of the test', () => this.all()),
        button('◂ Frame', 'Previous frame', () => this.step(-1)), button('Frame ▸', 'Next frame', () => this.step(1)),
        button('Next check ▸', 'Next check', () => this.nextCheck(1)),
        this.scale = element('span', { class: 'dim scale' }));
      const keys = element('p', { class: 'hint keys', id: `k${number}` },
        'Drag to zoom, shift and drag to move, click a frame or a check. Keys: ← → frame, n p check, + − zoom, page up and down move, 0 all.');
      const head = element('thead', {}, element('tr', {}, ...['Time, s', 'Frame', 'Decoded'].map((text) => element('th', { scope: 'col' }, text))));
      const table = element('div', { class: 'scroll near', tabindex: '0', role: 'region', 'aria-label': 'Frames around the selected one' },
        element('table', { class: 'frames' }, head, this.rows));
      table.hidden = true;
      this.near = table;
      this.box.replaceChildren(tools, this.canvas, this.said, table, keys);
      const on = (name, act, options) => this.canvas.addEventListener(name, act, options);
      on('keydown', (event) => this.key(event));
      on('pointerdown', (event) => this.press(event));
      on('pointermove', (event) => this.move(event));
      on('pointerup', (event) => this.release(event));
      on('pointercancel', () => { this.drag = null; this.draw(); });
      on('dblclick', () => this.all());
      on('wheel', (event) => this.wheel(event), { passive: false });
    }

    // Where things are.

    measure() {
      this.width = this.canvas.clientWidth;
      this.names = Math.min(NAMES, this.width * 0.3);
    }
    x(at) { return this.names + ((at - this.from) / (this.to - this.from)) * (this.width - this.names); }
    when(x) { return this.from + ((x - this.names) / (this.width - this.names)) * (this.to - this.from); }
    top(lane) { return AXIS + lane * ROW; }
    laneOf(frame) { return this.first + this.bus.words[this.bus.kind[frame]][2]; }

    // Index of the first frame at an instant or later.
    search(at) {
      let low = 0, high = this.bus.n;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (this.bus.at[middle] < at) low = middle + 1; else high = middle;
      }
      return low;
    }

    // Zooming and moving.

    view(from, to) {
      const pad = this.end * 0.02;
      const size = Math.min(Math.max(to - from, LEAST_NS), this.end + 2 * pad);
      this.from = Math.min(Math.max((from + to - size) / 2, -pad), this.end + pad - size);
      this.to = this.from + size;
      this.draw();
    }
    all() { this.view(-this.end, 2 * this.end); }
    zoom(factor, about = this.focus()) {
      const left = about - this.from, right = this.to - about;
      this.view(about - left * factor, about + right * factor);
    }
    focus() {
      const at = this.frame >= 0 ? this.bus.at[this.frame] : (this.from + this.to) / 2;
      return at < this.from || at > this.to ? (this.from + this.to) / 2 : at;
    }
    pan(share) {
      const by = (this.to - this.from) * share;
      this.view(this.from + by, this.to + by);
    }
    reveal(from, to = from) {
      if (from >= this.from && to <= this.to) return this.draw();
      const size = Math.max(this.to - this.from, (to - from) * 1.5);
      return this.view((from + to - size) / 2, (from + to + size) / 2);
    }

    // Selecting.

    step(by) {
      if (!this.bus.n) return;
      const from = this.frame >= 0 ? this.frame + by : this.search(this.from);
      this.showFrame(Math.min(Math.max(from, 0), this.bus.n - 1));
    }
    showFrame(frame) {
      this.frame = frame;
      this.check = this.bus.checks.findIndex((check) => check.effect === this.bus.at[frame]);
      this.tell();
      this.reveal(this.bus.at[frame]);
    }
    showCheck(number) {
      const check = this.bus.checks[number];
      this.check = number;
      const frame = 'effect' in check ? this.search(check.effect) : -1;
      this.frame = this.bus.at[frame] === check.effect ? frame : -1;
      this.tell();
      const from = check.cause ?? check.at - 2e8, to = Math.max(check.effect ?? check.at, check.at);
      this.view(from - (to - from) * 0.35 - 2e7, to + (to - from) * 0.35 + 2e7);
    }
    nextCheck(by) {
      const { checks } = this.bus;
      if (!checks.length) return;
      this.showCheck((this.check + by + checks.length) % checks.length);
    }

    tell() {
      const { bus, frame, check } = this;
      const parts = [];
      if (frame >= 0) {
        const [raw, text, lane, own, doubt] = bus.words[bus.kind[frame]];
        let before = frame - 1;
        while (before >= 0 && bus.words[bus.kind[before]][2] !== lane && frame - before < 5000) before--;
        const since = before >= 0 && bus.words[bus.kind[before]][2] === lane ? `, ${span(bus.at[frame] - bus.at[before])} after the one before it in its lane` : '';
        const late = doubt ? `, stamp late by at most ${span(doubt)}` : '';
        parts.push(`${seconds(bus.at[frame], 9)} s  ${own ? 'sent' : 'seen'} ${raw}  ${text}${since}${late}.`);
      }
      if (check >= 0) parts.push(`${bus.checks[check].outcome}: ${bus.checks[check].text}`);
      this.said.textContent = parts.join('  ') || 'Nothing is selected.';
      this.near.hidden = frame < 0;
      this.rows.replaceChildren(...(frame < 0 ? [] : this.neighbours()));
    }
    neighbours() {
      const { bus } = this;
      const rows = [];
      for (let frame = Math.max(0, this.frame - 4); frame < Math.min(bus.n, this.frame + 5); frame++) {
        const [raw, text, , own] = bus.words[bus.kind[frame]];
        const row = element('tr', { class: `${own ? 'sent' : 'seen'}${frame === this.frame ? ' chosen' : ''}` },
          element('td', { class: 'number' }, seconds(bus.at[frame])), element('td', { class: 'mono' }, (own ? '→ ' : '') + raw), element('td', {}, text));
        row.addEventListener('click', () => this.showFrame(frame));
        rows.push(row);
      }
      return rows;
    }

    // Keyboard, mouse, touch.

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const acts = {
        ArrowLeft: () => (event.shiftKey ? this.pan(-0.2) : this.step(-1)),
        ArrowRight: () => (event.shiftKey ? this.pan(0.2) : this.step(1)),
        PageUp: () => this.pan(-0.8), PageDown: () => this.pan(0.8),
        Home: () => this.bus.n && this.showFrame(0), End: () => this.bus.n && this.showFrame(this.bus.n - 1),
        '+': () => this.zoom(0.5), '=': () => this.zoom(0.5), '-': () => this.zoom(2), 0: () => this.all(),
        n: () => this.nextCheck(1), p: () => this.nextCheck(-1),
      };
      const act = acts[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    }
    press(event) {
      if (event.button || event.offsetX < this.names) return;
      this.canvas.setPointerCapture(event.pointerId);
      this.drag = { start: event.offsetX, now: event.offsetX, from: this.from, to: this.to, moves: event.shiftKey || event.pointerType === 'touch' };
    }
    move(event) {
      if (!this.drag) return;
      this.drag.now = event.offsetX;
      if (this.drag.moves) {
        const by = ((this.drag.start - event.offsetX) / (this.width - this.names)) * (this.to - this.from);
        this.view(this.drag.from + by, this.drag.to + by);
      } else this.draw();
    }
    release(event) {
      const { drag } = this;
      this.drag = null;
      if (!drag) return;
      if (Math.abs(drag.now - drag.start) < 4) this.click(event.offsetX, event.offsetY);
      else if (!drag.moves) this.view(this.when(Math.min(drag.start, drag.now)), this.when(Math.max(drag.start, drag.now)));
      else this.draw();
    }
    click(x, y) {
      const lane = Math.floor((y - AXIS) / ROW);
      const near = (this.to - this.from) * (NEAR / (this.width - this.names));
      const at = this.when(x);
      if (this.lanes[lane]?.kind === 'checks') {
        let best = -1;
        this.bus.checks.forEach((check, number) => {
          const far = Math.abs(check.at - at);
          if (far < near && (best < 0 || far < Math.abs(this.bus.checks[best].at - at))) best = number;
        });
        if (best >= 0) this.showCheck(best);
        return;
      }
      let best = -1, distance = near;
      for (let frame = this.search(at - near); frame < this.bus.n && this.bus.at[frame] <= at + near; frame++) {
        const far = Math.abs(this.bus.at[frame] - at) + (this.laneOf(frame) === lane ? 0 : near / 2);
        if (far <= distance) { best = frame; distance = far; }
      }
      if (best >= 0) this.showFrame(best);
      else { this.frame = -1; this.check = -1; this.tell(); this.draw(); }
    }
    wheel(event) {
      if (document.activeElement !== this.canvas && !event.ctrlKey) return;
      event.preventDefault();
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) this.pan(event.deltaX / this.width);
      else this.zoom(event.deltaY > 0 ? 1.3 : 1 / 1.3, this.when(Math.max(event.offsetX, this.names)));
    }

    // Drawing.

    recolour() { this.colours = null; this.draw(); }
    colour(name) {
      if (!this.colours) {
        const style = getComputedStyle(document.documentElement);
        this.colours = Object.fromEntries(COLOURS.map((each) => [each, style.getPropertyValue(`--${each}`).trim()]));
      }
      return this.colours[name];
    }
    draw() {
      this.measure();
      const { canvas, width } = this;
      if (!width || this.from === undefined) return;
      const height = AXIS + this.lanes.length * ROW + 8, ratio = devicePixelRatio || 1;
      canvas.style.height = `${height}px`;
      if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(height * ratio);
      }
      const pen = this.pen = canvas.getContext('2d');
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.font = '12px system-ui, sans-serif';
      pen.textBaseline = 'middle';
      this.fill('card', 0, 0, width, height);
      this.drawGround(height);
      pen.save();
      pen.beginPath();
      pen.rect(this.names, 0, width - this.names, height);
      pen.clip();
      this.drawLeftOut(height);
      this.drawBand();
      this.drawStates();
      this.drawFrames();
      this.drawEvents(height);
      this.drawChecks();
      this.drawArrows();
      this.drawChosen(height);
      pen.restore();
      this.scale.textContent = `${seconds(this.from, 3)} s … ${seconds(this.to, 3)} s, ${span(this.to - this.from)} wide`;
    }
    fill(colour, x, y, width, height) {
      this.pen.fillStyle = this.colour(colour);
      this.pen.fillRect(x, y, width, height);
    }
    write(text, x, y, colour = 'ink', most = Infinity) {
      const { pen } = this;
      if (most < 14) return;
      let shown = text;
      if (pen.measureText(shown).width > most) {
        const letter = pen.measureText(shown).width / shown.length;
        shown = `${shown.slice(0, Math.max(1, Math.floor(most / letter) - 1))}…`;
      }
      pen.fillStyle = this.colour(colour);
      pen.fillText(shown, x, y);
    }
    drawGround(height) {
      const { pen, width, names } = this;
      this.lanes.forEach((lane, number) => {
        if (number % 2 === 0) this.fill('sunk', 0, this.top(number), width, ROW);
        this.write(lane.name, 8, this.top(number) + ROW / 2, lane.kind === 'frames' ? 'ink' : 'dim', names - 14);
      });
      const wish = ((this.to - this.from) / (width - names)) * 110;
      const power = 10 ** Math.floor(Math.log10(wish));
      const tick = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= wish);
      const digits = Math.max(0, 9 - Math.floor(Math.log10(tick) + 1e-9));
      for (let at = Math.ceil(this.from / tick) * tick; at <= this.to; at += tick) {
        const x = this.x(at);
        if (x < names) continue;
        this.fill('rule', x, AXIS - 4, 1, height - AXIS);
        pen.textAlign = 'center';
        if (x > names + 20 && x < width - 30) this.write(`${seconds(at, digits)} s`, x, 11, 'dim');
        pen.textAlign = 'start';
      }
      this.fill('rule', names, 0, 1, height);
    }
    drawLeftOut(height) {
      for (const [from, to, count] of this.bus.left) {
        const x = this.x(from), far = this.x(to);
        this.hatch(x, AXIS, Math.max(far - x, 3), height - AXIS);
        this.write(`${count} frames left out; the recording has them`, Math.max(x, this.names) + 6, height - 12, 'dim', far - Math.max(x, this.names) - 12);
      }
    }
    hatch(x, y, width, height) {
      const { pen } = this;
      pen.save();
      pen.beginPath();
      pen.rect(x, y, width, height);
      pen.clip();
      pen.strokeStyle = this.colour('hatch');
      pen.beginPath();
      const start = Math.max(x, this.names) - height - ((Math.max(x, this.names) - x) % 8);
      for (let at = start; at < Math.min(x + width, this.width); at += 8) { pen.moveTo(at, y + height); pen.lineTo(at + height, y); }
      pen.stroke();
      pen.restore();
    }
    drawStates() {
      this.lanes.forEach((lane, number) => {
        if (lane.kind !== 'state') return;
        const y = this.top(number) + 3;
        for (const [from, to, label, state] of lane.spans) {
          if (to < this.from || from > this.to) continue;
          const x = Math.max(this.x(from), this.names), far = Math.min(this.x(to), this.width);
          const colour = STATES[state] || 'idle';
          this.pen.globalAlpha = state === 'off' ? 0.12 : 0.22;
          this.fill(colour, x, y, Math.max(far - x, 1), ROW - 6);
          this.pen.globalAlpha = 1;
          this.fill(colour, x, y, 2, ROW - 6);
          this.write(label, x + 6, y + (ROW - 6) / 2, 'ink', far - x - 10);
        }
      });
    }
    drawFrames() {
      const { bus } = this;
      const first = this.search(this.from), last = this.search(this.to);
      const filled = new Float64Array(this.lanes.length).fill(-9);
      const few = last - first < 400;
      const next = new Float64Array(this.lanes.length).fill(Infinity);
      const { from, names } = this, rate = (this.width - names) / (this.to - from);
      for (let frame = first; frame < last; frame++) {
        const x = names + (bus.at[frame] - from) * rate, lane = this.first + this.laneOfKind[bus.kind[frame]];
        if (x - filled[lane] < 0.75) continue;
        filled[lane] = x;
        this.fill(bus.words[bus.kind[frame]][3] ? 'sent' : 'seen', x - 1, this.top(lane) + 4, 2.5, ROW - 8);
      }
      if (!few) return;
      for (let frame = last - 1; frame >= first; frame--) {
        const x = this.x(bus.at[frame]), lane = this.laneOf(frame);
        const data = bus.words[bus.kind[frame]][0].split('#').pop();
        this.write(data, x + 5, this.top(lane) + ROW / 2, 'ink', Math.min(next[lane], this.width) - x - 9);
        next[lane] = x;
      }
    }
    drawEvents(height) {
      this.notes('events', this.bus.events, (x, lane, [, kind]) => {
        if (kind === 'frames lost' || kind === 'receive overflow') this.hatch(x - 5, AXIS, 10, height - AXIS);
        this.fill('failed', x - 0.5, AXIS, 1, height - AXIS);
        this.fill('failed', x - 3, this.top(lane) + 4, 6, ROW - 8);
      }, 'failed');
      this.notes('moments', this.bus.moments, (x, lane) => this.fill('stimulus', x - 1, this.top(lane) + 3, 3, ROW - 6), 'ink');
    }
    // Marks of a lane, each with as much of its text as there is room for before the next one.
    notes(kind, all, mark, colour) {
      const lane = this.lanes.findIndex((each) => each.kind === kind);
      all.forEach((note, number) => {
        const x = this.x(note[0]);
        if (note[0] < this.from || note[0] > this.to) return;
        const next = number + 1 < all.length ? this.x(all[number + 1][0]) : this.width;
        mark(x, lane, note);
        this.write(note[note.length - 1], x + 6, this.top(lane) + ROW / 2, colour, next - x - 9);
      });
    }

    // From a cause to what it caused.

    laneAt(at) {
      const frame = this.search(at);
      if (this.bus.at[frame] === at) return this.laneOf(frame);
      let best = 0, distance = 1e9;
      this.lanes.forEach((lane, number) => {
        if (lane.kind !== 'state') return;
        for (const [from] of lane.spans) {
          if (Math.abs(from - at) < distance) { best = number; distance = Math.abs(from - at); }
        }
      });
      return best;
    }
    drawBand() {
      const check = this.bus.checks[this.check];
      if (!check || check.effect === undefined || !check.limits) return;
      const lane = this.laneAt(check.effect), y = this.top(lane);
      const [low, high] = check.limits;
      const x = low === null ? this.x(check.cause) : this.x(check.cause + low);
      const far = high === null ? this.width : this.x(check.cause + high);
      this.fill('passed-soft', x, y, far - x, ROW);
      if (low !== null) this.fill('passed', x, y, 1.5, ROW);
      if (high !== null) this.fill('passed', far, y, 1.5, ROW);
      const from = this.x(check.cause + check.measured[0]), to = this.x(check.cause + check.measured[1]);
      this.hatch(from, y, Math.max(to - from, 2), ROW);
    }
    drawArrows() {
      const shown = this.bus.checks.filter((check) => check.effect !== undefined && check.effect >= this.from && check.cause <= this.to);
      if (shown.length < 120) for (const check of shown) if (check !== this.bus.checks[this.check]) this.drawArrow(check, false);
      const chosen = this.bus.checks[this.check];
      if (chosen && chosen.effect !== undefined) this.drawArrow(chosen, true);
    }
    drawArrow(check, chosen) {
      const { pen } = this;
      const x = this.x(check.cause), far = this.x(check.effect);
      if (!chosen && far - x < 4) return;
      const y = this.top(this.laneAt(check.cause)) + ROW / 2, to = this.top(this.laneAt(check.effect)) + ROW / 2;
      const colour = this.colour(check.outcome in { passed: 1 } ? 'passed' : BAD.has(check.outcome) ? check.outcome : 'idle');
      const tip = to + (to > y ? -7 : 7);
      pen.globalAlpha = chosen ? 1 : 0.35;
      pen.strokeStyle = pen.fillStyle = colour;
      pen.lineWidth = chosen ? 2 : 1;
      pen.beginPath();
      pen.moveTo(x, y);
      pen.bezierCurveTo(x + (far - x) * 0.5, y, far, to - (to - y) * 0.5, far, tip);
      pen.stroke();
      pen.beginPath();
      pen.moveTo(far, tip + (to > y ? 3 : -3));
      pen.lineTo(far - 4, tip - (to > y ? 4 : -4));
      pen.lineTo(far + 4, tip - (to > y ? 4 : -4));
      pen.fill();
      pen.beginPath();
      pen.arc(x, y, 3, 0, 7);
      pen.fill();
      pen.globalAlpha = 1;
      pen.lineWidth = 1;
      if (chosen) this.label(`${interval(check.measured)}${check.limits ? `, allowed ${limits(check.limits)}` : ''}: ${check.outcome}`, this.x(check.at), check.outcome);
    }
    // What was measured, beside its check.
    label(text, x, outcome) {
      const { pen } = this;
      pen.font = '600 12px system-ui, sans-serif';
      const width = pen.measureText(text).width;
      const left = x - width - 14 > this.names + 4 ? x - width - 14 : x + 14;
      const y = this.top(this.lanes.findIndex((each) => each.kind === 'checks')) + ROW / 2;
      this.fill('sunk', left - 4, y - ROW / 2, width + 8, ROW);
      this.write(text, left, y, BAD.has(outcome) ? outcome : 'ink');
      pen.font = '12px system-ui, sans-serif';
    }
    drawChecks() {
      const lane = this.lanes.findIndex((each) => each.kind === 'checks');
      const { pen } = this;
      let filled = -9;
      this.bus.checks.forEach((check, number) => {
        const x = this.x(check.at), y = this.top(lane) + ROW / 2;
        const bad = BAD.has(check.outcome);
        if (x < this.names - 9 || x > this.width + 9 || (!bad && number !== this.check && x - filled < 2)) return;
        filled = x;
        const size = number === this.check ? 7 : bad ? 6 : 4;
        pen.fillStyle = this.colour(bad ? check.outcome : check.outcome === 'passed' ? 'passed' : 'idle');
        pen.beginPath();
        pen.moveTo(x, y - size); pen.lineTo(x + size, y); pen.lineTo(x, y + size); pen.lineTo(x - size, y);
        pen.fill();
      });
    }
    drawChosen(height) {
      const { pen, drag } = this;
      if (this.frame >= 0) {
        const x = this.x(this.bus.at[this.frame]), y = this.top(this.laneOf(this.frame));
        pen.strokeStyle = this.colour('focus');
        pen.setLineDash([3, 3]);
        pen.beginPath();
        pen.moveTo(x + 0.5, AXIS);
        pen.lineTo(x + 0.5, height);
        pen.stroke();
        pen.setLineDash([]);
        pen.lineWidth = 2;
        pen.strokeRect(x - 4, y + 2, 8.5, ROW - 4);
        pen.lineWidth = 1;
      }
      if (drag && !drag.moves) {
        pen.globalAlpha = 0.15;
        this.fill('focus', Math.min(drag.start, drag.now), AXIS, Math.abs(drag.now - drag.start), height);
        pen.globalAlpha = 1;
      }
    }
  }

  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      const box = entry.target;
      if (!entry.isIntersecting || box.dataset.state) continue;
      box.dataset.state = 'opening';
      seen.unobserve(box);
      unpack(document.getElementById(`d${box.dataset.test}`).textContent)
        .then((bus) => { box.timeline = new Timeline(box, bus); box.dataset.state = 'open'; })
        .catch((error) => { box.dataset.state = 'failed'; box.textContent = `This timeline cannot be shown: ${error.message}`; });
    }
  }, { rootMargin: '200px' });
  for (const box of document.querySelectorAll('.timeline')) seen.observe(box);
})();
