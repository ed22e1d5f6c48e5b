// The library has no types of its own here.
declare const uPlot: any;
export default uPlot;
