// Format a number with at most three significant digits, without trailing zeros: 1.5, 120, 1000.
export const significant = (value) => String(Number(value.toPrecision(3)));

// Value at a fraction of a range, in equal ratios or differences; and the fraction of a value.
export const valueAt = ({ least, most, ratios }, share) => (ratios ? least * (most / least) ** share : least + (most - least) * share);
export const shareOf = ({ least, most, ratios }, value) =>
  ratios ? Math.log(value / least) / Math.log(most / least) : (value - least) / (most - least);
