"""The explorable: an essay in one HTML file, whose pictures simulate in the browser."""
