# Install rules live here; see docs/design.md.
