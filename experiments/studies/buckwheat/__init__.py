"""The paper's buckwheat: its study file, its published numbers, and its campaign as short scripts."""
