// The tension that restores the segments' lengths, written to `value`: the factor
// L D L^T of metric * (d d^T), row by row, with its forward substitution. Part of rods_substeps.comp.
// For loops that are not unrolled: four entries at a time.
#constants hairkit_plugins.rods.kernels LEAST
vec4 factor[FOURS(SEGMENTS) * (SEGMENTS + 4) / 2], scaled[FOURS(SEGMENT_ROOM)];

// Where row i of the factor begins, in fours; it has i entries and zeros up to the next four.
int row_of(int i) { return FOURS(i) * (2 * ((i - 1) / 4) + (i - 1) % 4); }

void solve_lengths() {
    int count = u_nodes - 1;
    for (int k = 0; k < FOURS(count); k++) scaled[k] = vec4(0.0);
    for (int i = 0; i < count; i++) {
        vec3 way = direction[i], excess = edge[i] + solved[i + 1] - solved[i];
        float right = dot(excess, way) - banded(i).w, last = 0.0;
        vec4 entries = vec4(0.0);
        for (int j = 0; j < i; j++) {
            float here = next_metric(i * (i + 1) / 2 + j) * dot(way, direction[j]);
            int row = row_of(j);
            for (int k = 0; k < FOURS(j); k++) here -= dot(scaled[k], factor[row + k]);
            float low = here * pivot[j];
            if (j % 4 == 0) entries = vec4(0.0);
            entries[j % 4] = low;
            factor[row_of(i) + j / 4] = entries;
            scaled[j / 4][j % 4] = here;
            last -= here * low;
            right -= low * value[j];
        }
        float own = next_metric(i * (i + 1) / 2 + i);
        pivot[i] = 1.0 / max(last + own * dot(way, way), LEAST * own);
        value[i] = right;
    }
    for (int i = 0; i < count; i++) value[i] *= pivot[i];
    for (int i = count - 1; i > 0; i--)
        for (int k = 0; k < FOURS(i); k++) {
            vec4 less = factor[row_of(i) + k] * value[i];
            for (int c = 0; c < 4; c++) value[4 * k + c] -= less[c];
        }
}
