// Plots over time that grow while a run goes on, drawn on canvases: a chart library draws a few
// frames a second where this draws as often as the screen. Rows are [t, curves of one chart after
// the other], null where nothing is known.

const MARGIN = { left: 52, right: 14, top: 20, bottom: 22 };
const RIGHT_AXIS = 46;
const FONT = "11px system-ui, sans-serif";
const MOST_POINTS = 700;
const HEIGHT = 150;
const DASHES = { "-": [], "--": [6, 3], "-.": [8, 3, 2, 3], ":": [2, 3] };

export default {
  template: `<div class="cdpr-plots">
    <figure v-for="(chart, k) in charts" :key="k" class="cdpr-plot">
      <canvas :ref="'canvas' + k" role="img" :aria-label="chart.title + ' over time'"></canvas>
    </figure>
    <div class="cdpr-plots-legend" v-if="charts.length">
      <span v-for="item in legend" :key="item.name">
        <svg width="26" height="8"><line x1="0" y1="4" x2="26" y2="4" stroke-width="2"
          :stroke="item.color === '#303030' ? 'currentColor' : item.color" :stroke-dasharray="item.dash.join(' ')"/></svg>{{ item.name }}</span>
      <span v-if="others.length">faint: {{ otherName }}</span>
    </div>
  </div>`,
  data() {
    return { charts: [], otherName: "" };
  },
  computed: {
    legend() {
      const seen = new Map();
      for (const chart of this.charts) for (const one of chart.series) seen.set(one.name, one);
      return [...seen.values()];
    },
  },
  created() {
    this.rows = [];
    this.others = [];
    this.duration = 0;
    this.span = null;
    this.cursorTime = null;
    this.due = false;
    this.token = null;
    this.frames = 0;
  },
  mounted() {
    this.observer = new ResizeObserver(() => this.plan());
    this.observer.observe(this.$el);
    this.themes = new MutationObserver(() => this.plan());
    this.themes.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.$emit("mounted");
  },
  beforeUnmount() {
    this.observer.disconnect();
    this.themes.disconnect();
  },
  methods: {
    begin(charts, duration) {
      const curve = ([name, look]) => ({ name, color: look.color, dash: DASHES[look.dash] });
      this.charts = charts.map((chart) => ({ ...chart, series: chart.series.map(curve) }));
      this.duration = duration;
      this.rows = [];
      this.others = [];
      this.otherName = "";
      this.cursorTime = null;
      this.$nextTick(() => this.plan());
    },
    put(rows, token) {
      for (const row of rows) this.rows.push(row);
      this.token = token;
      this.plan();
    },
    compare(rows, name) {
      this.others = rows || [];
      this.otherName = name || "";
      this.$forceUpdate();
      this.plan();
    },
    show_span(seconds) {
      this.span = seconds;
      this.plan();
    },
    cursor(time) {
      this.cursorTime = time;
      this.plan();
    },
    plan() {
      if (this.due) return;
      this.due = true;
      requestAnimationFrame(() => {
        this.due = false;
        this.draw();
        this.frames += 1;
        this.$el.dataset.frames = this.frames;
        this.$el.dataset.rows = this.rows.length;
        if (this.token !== null) {
          const token = this.token;
          this.token = null;
          this.$emit("drawn", token);
        }
      });
    },
    draw() {
      let first = 1;
      const style = getComputedStyle(this.$el);
      const colors = {
        ink: style.color,
        line: style.getPropertyValue("--studio-line") || "#c8ccd2",
        soft: style.getPropertyValue("--studio-soft") || "#5a6068",
      };
      this.charts.forEach((chart, k) => {
        const found = this.$refs["canvas" + k];
        const canvas = Array.isArray(found) ? found[0] : found;
        if (canvas) this.drawChart(canvas, chart, first, colors);
        first += chart.series.length;
      });
    },
    drawChart(canvas, chart, first, colors) {
      const ratio = window.devicePixelRatio || 1;
      const width = canvas.parentElement.clientWidth;
      if (!width) return;
      if (canvas.width !== Math.round(width * ratio)) {
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(HEIGHT * ratio);
        canvas.style.width = width + "px";
        canvas.style.height = HEIGHT + "px";
      }
      const pen = canvas.getContext("2d");
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, width, HEIGHT);
      const box = {
        left: MARGIN.left,
        right: width - MARGIN.right - (chart.right ? RIGHT_AXIS : 0),
        top: MARGIN.top,
        bottom: HEIGHT - MARGIN.bottom,
      };
      const times = this.timeRange();
      const rows = this.visible(this.rows, times);
      const others = this.visible(this.others, times);
      const count = chart.series.length;
      const onLeft = chart.right ? count - 1 : count;
      const left = range([rows, others], first, onLeft, chart.limits);
      const right = chart.right ? range([rows, others], first + onLeft, 1, []) : null;
      frame(pen, box, times, left, colors, chart.title);
      if (right) rightAxis(pen, box, right, colors, chart.right);
      pen.save();
      pen.beginPath();
      pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
      pen.clip();
      for (const limit of chart.limits) {
        pen.strokeStyle = colors.soft;
        pen.setLineDash([9, 3]);
        pen.lineWidth = 1;
        const y = place(limit, left, box.bottom, box.top);
        line(pen, box.left, y, box.right, y);
      }
      chart.series.forEach((one, k) => {
        const axis = right && k === onLeft ? right : left;
        curve(pen, others, first + k, box, times, axis, one, colors.ink, 0.35, 1);
        curve(pen, rows, first + k, box, times, axis, one, colors.ink, 1, 1.6);
      });
      if (this.cursorTime !== null) {
        pen.strokeStyle = colors.ink;
        pen.setLineDash([]);
        pen.lineWidth = 1;
        const x = place(this.cursorTime, times, box.left, box.right);
        line(pen, x, box.top, x, box.bottom);
      }
      pen.restore();
    },
    timeRange() {
      const end = (list) => (list.length ? list[list.length - 1][0] : 0);
      const last = Math.max(end(this.rows), end(this.others), 1e-3);
      if (this.span && this.cursorTime === null && last > this.span) return [last - this.span, last];
      return [0, last];
    },
    visible(rows, [start]) {
      const first = rows.findIndex((row) => row[0] >= start);
      return first > 0 ? rows.slice(first - 1) : rows;
    },
  },
};

function range(lists, first, count, limits) {
  let low = Infinity;
  let high = -Infinity;
  for (const rows of lists) {
    for (const row of rows) {
      for (let k = first; k < first + count; k++) {
        const value = row[k];
        if (value === null || value === undefined) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
  }
  if (low > high) [low, high] = [0, 1];
  // Bounds are shown where the curves come near; far ones would make lines of them.
  const reach = Math.max(high - low, 0.05 * Math.abs(high), 1e-9);
  for (const limit of limits) {
    if (limit < low && low - limit < reach) low = limit;
    if (limit > high && limit - high < reach) high = limit;
  }
  const pad = Math.max(0.06 * (high - low), 1e-9 + 1e-4 * Math.abs(high));
  return [low - pad, high + pad];
}

function place(value, [low, high], from, to) {
  return from + ((value - low) / (high - low)) * (to - from);
}

function line(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

function ticks([low, high], most) {
  const rough = (high - low) / most;
  const power = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= rough);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return found.map((value) => [value, value.toFixed(Math.min(digits, 6))]);
}

function frame(pen, box, times, values, colors, title) {
  pen.font = FONT;
  pen.lineWidth = 1;
  pen.setLineDash([]);
  pen.strokeStyle = colors.line;
  pen.fillStyle = colors.ink;
  pen.textAlign = "left";
  pen.fillText(title, 4, 12);
  pen.textAlign = "right";
  for (const [value, words] of ticks(values, 4)) {
    const y = place(value, values, box.bottom, box.top);
    line(pen, box.left, y, box.right, y);
    pen.fillText(words, box.left - 5, y + 4);
  }
  pen.textAlign = "center";
  const instants = ticks(times, 6);
  for (const [k, [value, words]] of instants.entries()) {
    const x = place(value, times, box.left, box.right);
    line(pen, x, box.bottom, x, box.bottom + 4);
    pen.fillText(k === instants.length - 1 ? `${words} s` : words, x, box.bottom + 16);
  }
  pen.strokeStyle = colors.soft;
  pen.strokeRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
}

function rightAxis(pen, box, values, colors, title) {
  pen.fillStyle = colors.ink;
  pen.textAlign = "right";
  pen.fillText(title, box.right + RIGHT_AXIS + 8, 12);
  pen.textAlign = "left";
  for (const [value, words] of ticks(values, 4)) {
    pen.fillText(words, box.right + 5, place(value, values, box.bottom, box.top) + 4);
  }
}

function curve(pen, rows, column, box, times, values, one, ink, alpha, width) {
  const stride = Math.max(1, Math.ceil(rows.length / MOST_POINTS));
  pen.strokeStyle = one.color === "#303030" ? ink : one.color;
  pen.globalAlpha = alpha;
  pen.lineWidth = width;
  pen.setLineDash(one.dash);
  pen.beginPath();
  let open = false;
  const point = (row) => {
    const x = place(row[0], times, box.left, box.right);
    const y = place(row[column], values, box.bottom, box.top);
    if (open) pen.lineTo(x, y);
    else pen.moveTo(x, y);
    open = true;
  };
  // Of many rows each group by its extremes, so that no peak is lost.
  for (let start = 0; start < rows.length; start += stride) {
    let least = null;
    let largest = null;
    for (let k = start; k < Math.min(start + stride, rows.length); k++) {
      const value = rows[k][column];
      if (value === null || value === undefined) continue;
      if (least === null || value < rows[least][column]) least = k;
      if (largest === null || value > rows[largest][column]) largest = k;
    }
    if (least === null) {
      open = false;
      continue;
    }
    point(rows[Math.min(least, largest)]);
    if (least !== largest) point(rows[Math.max(least, largest)]);
  }
  pen.stroke();
  pen.globalAlpha = 1;
}
