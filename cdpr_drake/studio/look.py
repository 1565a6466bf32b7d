"""How the page looks, beside Quasar: the layout, which is narrow on a phone, and its colours."""

from __future__ import annotations

from cdpr_drake.palette import SLACK

STYLE = f"""
:root {{ --studio-line: #c8ccd2; --studio-soft: #5a6068; --studio-problem: {SLACK}; }}
body.body--dark {{ --studio-line: #43484f; --studio-soft: #a9b0b8; --studio-problem: #ff7b72; }}
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
@media (min-width: 1700px) {{
  .studio-main {{ grid-template-columns: minmax(0, 860px) minmax(0, 1fr); }}
}}
@media (max-width: 860px) {{
  .studio-main {{ display: block; height: auto; }}
  .studio-scene {{ height: 38vh; border-left: 0; border-bottom: 1px solid var(--studio-line); }}
  .studio-name {{ display: none; }}
}}
"""
