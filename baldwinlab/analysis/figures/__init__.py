"""Draw figures with Matplotlib, without a display: styles, primitives, panels and files."""
