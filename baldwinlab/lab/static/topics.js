/** What views say of themselves before anything is shown, for "What is this?". */

/** @typedef {import("./guide.js").Topic} Topic */

/** @type {Topic[]} */
export const LIVE = [
  {
    title: "Evolution, live",
    text: "Every generation lives its life, and who does best has children. Choose a preset, change any parameter, and start: the generations follow each other while you watch.",
  },
  {
    title: "The curves",
    text: "How well the best and the average agent do, a point a generation, as mean of all runs; the shaded band is where the true mean lies with 95 % confidence. A click on a curve shows that generation's life.",
  },
  {
    title: "What to look for",
    text: "Do the curves rise, and how soon? Start the same once more without learning, or with another seed, and compare.",
  },
];

/** Where there is a server. @type {Topic} */
export const KEEPING = {
  title: "To go on",
  text: "Sweep a field, and see what it does. What is worth keeping can be kept as a study.",
};

/** Of the slider of the generations of a stored run. */
export const CURVE =
  "The curve of the generations is this run's: its line is the best agent, its area the average one.";

/** Of lives without a world, by the kind of what is shown. @type {Object<string, Topic[]>} */
export const LOOKS = {
  alleles: [
    {
      title: "The bars",
      text: "Each bar is a locus of the genomes with which a generation is born, and each part of it the share of agents that have this allele there. Lives have no world to watch here; what selection makes of genomes can be watched.",
    },
    {
      title: "What to look for",
      text: "Play the generations. Where does one allele take over, and when? What happens to the curve at that time? Where a bar no longer changes, all agents have the same allele.",
    },
  ],
  walk: [
    {
      title: "The lines",
      text: "From birth, at 0, to death. A name below the chart hides its line and shows it again. Go through the generations: what is learned in life at first, and what is there from birth on at last?",
    },
  ],
  matrix: [
    {
      title: "The table",
      text: "The more colour a cell has, the larger its number. Go through the generations, and see which rows come and go.",
    },
  ],
  cells: [
    {
      title: "The cells",
      text: "The agent is the blue dart, or a disc where it has no heading; its line is the way that it went. Space plays and pauses, the arrow keys go a step. The agent of this number in another generation is somebody else, with a genome of its own.",
    },
  ],
};

/** @type {Topic[]} */
export const PAPERS = [
  {
    title: "The papers",
    text: "Each card is a publication that can be reproduced here: what it is about, how much is run for it, and, where this folder holds a study of it, what came of its claims.",
  },
  {
    title: "To run one",
    text: "Run live shows one of its conditions while it evolves. The command runs the whole paper, with statistics and a report, into the folder results; in a lab that shows it, the study stands on the card.",
  },
];

/** @type {Topic[]} */
export const RESULTS = [
  {
    title: "The curves",
    text: "Each condition's mean over its runs, generation by generation; the shaded band is where the true mean lies with 95 % confidence. Each run can be shown as a thin line beside it. A click on a line shows the life behind it.",
  },
  {
    title: "The boxes",
    text: "Each run is a point: its mean over the last generations. The line in a box is the median, half of the runs lie in the box.",
  },
  {
    title: "What to look for",
    text: "Bands that do not overlap tell conditions apart. Where points scatter widely, a single run says little. The comparison says which differences the runs establish.",
  },
];
