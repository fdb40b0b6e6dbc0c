// A number to three significant digits, without zeros that say nothing: 1.5, 120, 1000.
export const significant = (value) => String(Number(value.toPrecision(3)));

// What lies at a share of the way from the least to the most, by equal ratios or differences, and the share of a value.
export const valueAt = ({ least, most, ratios }, share) => (ratios ? least * (most / least) ** share : least + (most - least) * share);
export const shareOf = ({ least, most, ratios }, value) =>
  ratios ? Math.log(value / least) / Math.log(most / least) : (value - least) / (most - least);
