// Nothing but what all pages share: the place that the address names.
land();
root.dataset.drawn = Math.round(performance.now()); // every control works, ms
