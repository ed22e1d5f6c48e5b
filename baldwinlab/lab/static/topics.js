/** Texts of the guide ("What is this?") for each view. */

/** @typedef {import("./guide.js").Topic} Topic */

/** @type {Topic[]} */
export const LIVE = [
  {
    title: "Live run",
    text:
      "This tab simulates evolution while you watch. In each generation, all agents live one" +
      " life, and the fittest agents have children. Choose a preset, change parameters if you" +
      " like, and press Start.",
  },
  {
    title: "The curves",
    text:
      "The curves show the fitness of the best and of the average agent in each generation." +
      " With several runs, a curve is their mean, and the band is the 95 % confidence interval" +
      " of the mean. Click a curve to watch that generation.",
  },
  {
    title: "What to look for",
    text:
      "Check whether the curves rise, and how early. Then start the same experiment without" +
      " learning, or with another seed, and compare. A difference that appears with one seed" +
      " only can be due to chance.",
  },
];

/** For a lab with a server. @type {Topic} */
export const SAVING = {
  title: "Next steps",
  text:
    "Sweep a field runs the experiment with several values of one parameter. Save as a study" +
    " stores a live run. The Results tab shows both.",
};

/** The generation slider of a stored run. */
export const CURVE =
  "The curve at the generation slider shows this run: the line is the best agent, the area is" +
  " the average agent.";

/** Models without a world, by the kind of view. @type {Object<string, Topic[]>} */
export const VIEWS = {
  alleles: [
    {
      title: "The bars",
      text:
        "Each bar is one locus of the genome. The parts of a bar show the share of agents that" +
        " are born with each allele. This model has no world, so the view shows genomes" +
        " instead of lifetimes.",
    },
    {
      title: "What to look for",
      text:
        "Play the generations and compare the bars with the fitness curve. A part that grows" +
        " is an allele that spreads. If a bar has only one part, all agents have the same" +
        " allele.",
    },
  ],
  path: [
    {
      title: "The lines",
      text:
        "Each line shows one value from birth (0) to death. A line that changes during life" +
        " shows learning. If the value at birth changes over the generations, innate" +
        " behavior evolves.",
    },
  ],
  matrix: [
    {
      title: "The table",
      text:
        "Each cell contains one number. A stronger color means a larger number. Compare" +
        " generations to see which rows change.",
    },
  ],
  grid: [
    {
      title: "The grid",
      text:
        "The blue dart is the agent, and the line is its path. Press Space to play or pause," +
        " and the arrow keys to move one step. The same number in another generation is a" +
        " different agent with its own genome.",
    },
  ],
};

/** @type {Topic[]} */
export const PAPERS = [
  {
    title: "The Baldwin effect",
    text:
      "Learning can change the course of evolution, although learned behavior is not inherited." +
      " Baldwin expected two phases: first, agents that learn a useful behavior have more" +
      " children; then, the behavior becomes innate. The gallery measures both.",
  },
  {
    title: "The papers",
    text:
      "Each card describes a publication that you can reproduce here. It shows the topic and" +
      " the number of conditions, runs and claims. If this folder contains a study of the" +
      " paper, the card also shows the verdicts.",
  },
  {
    title: "Run a paper",
    text:
      "Run live starts one condition of the paper in this lab. The command runs the complete" +
      " paper and writes statistics and a report into the folder results. A lab that serves" +
      " this folder shows the study on the card.",
  },
];

/** @type {Topic[]} */
export const RESULTS = [
  {
    title: "The curves",
    text:
      "Each curve is the mean of one condition over its runs. The band is the 95 % confidence" +
      " interval of the mean. Click a curve to watch that generation.",
  },
  {
    title: "The boxes",
    text:
      "Each point is one run, averaged over its last generations. The line in a box is the" +
      " median, and the box contains half of the runs. If the points scatter widely, a single" +
      " run says little.",
  },
  {
    title: "What to look for",
    text:
      "Bands that do not overlap suggest a difference between conditions. The comparison table" +
      " tests each difference. Its verdict says whether the runs establish it.",
  },
];
