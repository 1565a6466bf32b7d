"""How the page looks, beside Quasar: the layout, which is narrow on a phone, and its colours."""

from __future__ import annotations

from cdpr_drake.palette import SLACK

STYLE = f"""
:root {{ --studio-line: #c8ccd2; --studio-soft: #5a6068; --studio-problem: {SLACK};
  --studio-track: #e6e9ed; }}
body.body--dark {{ --studio-line: #43484f; --studio-soft: #a9b0b8; --studio-problem: #ff7b72;
  --studio-track: #969ca3; }}
.nicegui-content {{ padding: 0 !important; }}
.studio-header {{ padding: 0 0.8rem; gap: 0.6rem; align-items: center; flex-wrap: nowrap;
  min-height: 2.8rem; background: #24476b !important; }}
.studio-name {{ font-weight: 600; white-space: nowrap; }}
.studio-main {{ display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); width: 100%;
  height: calc(100vh - 2.8rem); }}
.studio-scene {{ order: 2; border-left: 1px solid var(--studio-line); }}
.studio-scene iframe {{ width: 100%; height: 100%; border: 0; display: block; }}
.studio-panels {{ order: 1; overflow: auto; background: transparent; }}
.studio-problem {{ color: var(--studio-problem); white-space: pre-line; padding: 1rem; }}
.studio-notice .q-notification__message {{ white-space: pre-line; overflow-wrap: anywhere; }}
.studio-soft {{ color: var(--studio-soft); }}
.studio-row {{ width: 100%; gap: 0.6rem; flex-wrap: wrap; margin: 0.4rem 0; }}
.studio-sliders {{ display: grid; width: 100%; grid-template-columns: 1.2rem minmax(0, 1fr) 8.2rem;
  gap: 0.15rem 0.8rem; align-items: center; }}
.studio-axis {{ font-weight: 600; text-align: right; }}
.studio-cables, .studio-facts {{ width: 100%; border-collapse: collapse; font-size: 0.86rem;
  font-variant-numeric: tabular-nums; margin: 0.4rem 0; }}
.studio-cables th, .studio-cables td, .studio-facts th, .studio-facts td {{
  padding: 0.16rem 0.5rem; text-align: right; border-bottom: 1px solid var(--studio-line); }}
.studio-cables thead th {{ font-weight: 500; color: var(--studio-soft); }}
.studio-cables th:first-child, .studio-cables th:nth-child(2), .studio-facts th,
.studio-facts td {{ text-align: left; }}
.studio-facts th {{ font-weight: 500; color: var(--studio-soft); white-space: nowrap; }}
.studio-facts td {{ overflow-wrap: anywhere; }}
.studio-cables .swatch {{ display: inline-block; width: 0.75rem; height: 0.75rem;
  border-radius: 50%; margin-right: 0.4rem; vertical-align: -1px;
  outline: 1px solid var(--studio-line); }}
.studio-cables td.bar {{ width: 40%; padding-right: 0; }}
.studio-cables td.bar div {{ position: relative; height: 0.85rem;
  background: var(--studio-track); }}
.studio-cables td.bar b {{ position: absolute; left: 0; top: 0; height: 100%; min-width: 2px; }}
.studio-cables td.bar .tick {{ position: absolute; top: -2px; bottom: -2px; width: 2px;
  background: currentColor; }}
.studio-cables tr.slack td, .studio-cables tr.slack th {{ color: var(--studio-problem);
  font-weight: 600; }}
@media (min-width: 1700px) {{
  .studio-main {{ grid-template-columns: minmax(0, 860px) minmax(0, 1fr); }}
}}
@media (max-width: 860px) {{
  .studio-main {{ display: block; height: auto; }}
  .studio-scene {{ height: 38vh; border-left: 0; border-bottom: 1px solid var(--studio-line); }}
  .studio-name {{ display: none; }}
}}
"""
