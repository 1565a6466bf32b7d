"""Studies that repeat what was published, one package or module each; they do not know each other.

`studies.catalogue` is their table. `studies.published` is what was published, as data, and
`studies.framework` what case studies and studies over seeds share.
"""
