// Normal and roughness maps. The tangent frame is that of the texture coordinates on the screen
// (Schueler 2006, "Normal mapping without precomputed tangents").

uniform sampler2D u_normals;
uniform float u_has_normals;
uniform sampler2D u_rough;
uniform float u_has_rough;

vec3 mapped_normal(vec3 normal, vec3 position, vec2 uv) {
    vec3 px = dFdx(position), py = dFdy(position);
    vec2 tx = dFdx(uv), ty = dFdy(uv);
    vec3 across_y = cross(py, normal), across_x = cross(normal, px);
    vec3 along_u = across_y * tx.x + across_x * ty.x;
    vec3 along_v = across_y * tx.y + across_x * ty.y;
    float largest = max(dot(along_u, along_u), dot(along_v, along_v));
    if (u_has_normals < 0.5 || largest <= 0.0) return normal;
    float handed = dot(cross(px, py), normal) < 0.0 ? -1.0 : 1.0;   // pictures are upside down
    vec3 local = texture(u_normals, uv).rgb * 2.0 - 1.0;
    vec2 slope = local.xy * handed * inversesqrt(largest);
    return normalize(along_u * slope.x + along_v * slope.y + normal * max(local.z, 0.05));
}

float mapped_roughness(float plain, vec2 uv) {
    return mix(plain, texture(u_rough, uv).r, u_has_rough);
}
