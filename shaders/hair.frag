#version 430
// Strands thinner than a sample cover it by chance: stochastic transparency (Enderton et al. 2010), which
// needs no order. Chances are spread evenly over neighbouring samples, and differ from strand to strand.

in vec4 v_colour;
out vec4 out_colour;

// Interleaved gradient noise (Jimenez 2014), its constants included.
float spread_chance(vec2 sample_px) {
    return fract(52.9829189 * fract(dot(sample_px, vec2(0.06711056, 0.00583715))));
}

void main() {
    float own = fract(0.61803399 * float(gl_PrimitiveID));
    if (v_colour.a < fract(spread_chance(gl_FragCoord.xy) + own)) discard;
    out_colour = vec4(v_colour.rgb, 1.0);
}
