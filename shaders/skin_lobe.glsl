// The oil on skin: a microfacet lobe, f = D F G / (4 (n.l) (n.v)); the twin of tests/support/skin_twins.py.
// GGX and Beckmann with Smith's shadowing: Walter et al. 2007. Blinn-Phong as a distribution of
// facets: Blinn 1977. Torrance-Sparrow: their V-shaped grooves with Beckmann's distribution,
// Cook and Torrance 1982. Fresnel: Schlick 1994.

const int GGX = 0;
const int BECKMANN = 1;
const int BLINN_PHONG = 2;
const float LOBE_PI = 3.14159265;

float distribution(int lobe, float alpha, float nh) {
    float a2 = alpha * alpha, c2 = nh * nh;
    if (lobe == GGX) {
        float d = c2 * (a2 - 1.0) + 1.0;
        return a2 / (LOBE_PI * d * d);
    }
    if (lobe == BLINN_PHONG) {
        float power = max(2.0 / a2 - 2.0, 0.0);   // the width of Beckmann's with this alpha
        return (power + 2.0) / (2.0 * LOBE_PI) * pow(max(nh, 1e-6), power);
    }
    return exp((c2 - 1.0) / (a2 * max(c2, 1e-6))) / (LOBE_PI * a2 * max(c2 * c2, 1e-9));
}

float smith(int lobe, float alpha, float c) {
    if (lobe == GGX) return 2.0 * c / (c + sqrt(alpha * alpha + (1.0 - alpha * alpha) * c * c));
    float a = c / (alpha * sqrt(max(1.0 - c * c, 1e-9)));
    return a < 1.6 ? a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a)) : 1.0;
}

float shadowing(int lobe, float alpha, float nl, float nv, float nh, float vh) {
    if (lobe == GGX || lobe == BECKMANN) return smith(lobe, alpha, nl) * smith(lobe, alpha, nv);
    return min(1.0, 2.0 * nh * min(nl, nv) / max(vh, 1e-6));
}

float fresnel(float f0, float c) { return f0 + (1.0 - f0) * pow(clamp(1.0 - c, 0.0, 1.0), 5.0); }

// Reflected share of the light of a direction, for each steradian: f (n.l).
float oil(int lobe, float alpha, float f0, vec3 n, vec3 l, vec3 v) {
    float nl = dot(n, l), nv = dot(n, v);
    if (nl <= 0.0 || nv <= 0.0) return 0.0;
    vec3 h = normalize(l + v);
    float nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
    float dg = distribution(lobe, alpha, nh) * shadowing(lobe, alpha, nl, nv, nh, vh);
    return dg * fresnel(f0, vh) / (4.0 * nv);
}

// Share of the light that enters the skin and leaves it again through the oil.
float below(float f0, float nl, float nv) { return (1.0 - fresnel(f0, nl)) * (1.0 - fresnel(f0, nv)); }
