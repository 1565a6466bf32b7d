"""How the run panel looks, beside `studio.look`."""

from __future__ import annotations

RUN_STYLE = """
.cdpr-run { width: 100%; padding: 0 0.6rem; box-sizing: border-box; display: flex;
  flex-direction: column; gap: 0.5rem; }
.cdpr-run .q-field { min-width: 7rem; }
.cdpr-speed { width: 10.5rem; }
.cdpr-compare { width: 14rem; }
.cdpr-state { font-weight: 600; white-space: nowrap; }
.cdpr-outcome { white-space: nowrap; }
.cdpr-time { font-variant-numeric: tabular-nums; min-width: 4.5rem; }
.cdpr-soft { color: var(--studio-soft); font-size: 0.82rem; min-height: 1.2rem; }
.cdpr-run .studio-problem { padding: 0; }
.cdpr-run-view { display: flex; gap: 0.8rem; width: 100%; align-items: flex-start; }
.cdpr-run-state { flex: 1; min-width: 0; display: flex; flex-direction: column; gap: 0.2rem; }
.cdpr-camera { margin: 0; flex: 0 0 auto; width: 16rem; max-width: 45%; }
.cdpr-camera img { display: block; width: 100%; height: auto;
  border: 1px solid var(--studio-line); }
.cdpr-plots { width: 100%; min-width: 0; }
.cdpr-plot { margin: 0 0 0.3rem 0; width: 100%; }
.cdpr-plot canvas { display: block; }
.cdpr-plots-legend { display: flex; flex-wrap: wrap; gap: 0.1rem 0.9rem; font-size: 0.8rem; }
.cdpr-plots-legend svg { margin-right: 0.3rem; }
.cdpr-fields { display: grid; gap: 0.5rem 0.7rem; width: 100%;
  grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); }
.cdpr-fold { width: 100%; }
@media (max-width: 600px) {
  .cdpr-run > .row.no-wrap { flex-wrap: wrap !important; }
  .cdpr-run > .row.no-wrap > .q-field.col { flex: 1 1 100%; }
  .cdpr-run > .row.no-wrap > .cdpr-speed { flex: 1 1 7rem; width: auto; }
}
@media (min-width: 1700px) { .cdpr-camera { width: 22rem; } }
"""
