// The tension that restores the segments' lengths, written to `value`: the factor
// L D L^T of metric * (d d^T), row by row, with its forward substitution. Part of rods_substeps.comp.
// For loops that are unrolled: entries stay in registers.
#constants hairkit_plugins.rods.kernels LEAST
float factor[SEGMENTS * (SEGMENTS - 1) / 2], scaled[SEGMENTS];

void solve_lengths() {
    for (int i = 0; i < SEGMENTS; i++) {
        vec3 way = direction[i], excess = edge[i] + solved[i + 1] - solved[i];
        float right = dot(excess, way) - banded(i).w, last = 0.0;
        for (int j = 0; j < SEGMENTS; j++)
            if (j < i) {
                float here = next_metric(i * (i + 1) / 2 + j) * dot(way, direction[j]);
                for (int k = 0; k < SEGMENTS; k++)
                    if (k < j) here -= scaled[k] * factor[j * (j - 1) / 2 + k];
                scaled[j] = here;
                float low = here * pivot[j];
                factor[i * (i - 1) / 2 + j] = low;
                last -= here * low;
                right -= low * value[j];
            }
        float own = next_metric(i * (i + 1) / 2 + i);
        pivot[i] = 1.0 / max(last + own * dot(way, way), LEAST * own);
        value[i] = right;
    }
    for (int i = SEGMENTS - 1; i >= 0; i--) {
        float pull = value[i] * pivot[i];
        for (int k = 0; k < SEGMENTS; k++)
            if (k > i) pull -= factor[k * (k - 1) / 2 + i] * value[k];
        value[i] = pull;
    }
}
