function [answer, flags, state] = $function(what, level, place, speed, force, stroke, state)
%$function  Forces of a fitted cable.
%
$about
%
%  output = $function('output', level, place, speed, input_force, stroke)
%     Force at the load side while the cable slides, computed from the force at the motor side.
%  input = $function('input', level, place, speed, output_force, stroke)
%     Force at the motor side that gives output_force at the load side: the inverse of 'output'.
$step_words
%  more = $function('compensation', 0, place, speed, output_force, stroke)
%     Force to add at the motor so that output_force arrives at the load, for the friction that any one mounting exceeds
%     with a probability of 95 %.
%  [names, places] = $function('levels')
%     Names of the levels, and the places at which friction is tabulated.
%
%  level: $level_words.
%  place: $place_words
%  speed: $speed_words
%  stroke: +1 pulling (a loop: moving forward), -1 returning (back). Forces are in newtons; arguments may be
%          arrays of equal size.
%  flags: 1 the place is outside the range, and the nearest end was used; 2 no force remains; 4 the result is not a number;
%         or a sum of these.
    persistent T
    if isempty(T)
        T = tables();
    end
    if strcmp(what, 'levels')
        answer = T.names;
        flags = T.place;
        return
    end
    if nargin < 7
        state = [];
    end
    if strcmp(what, 'step') && T.of_turns
        [answer, flags, state] = crept(T, level, place, speed, force, stroke, state);
    elseif strcmp(what, 'step')
        [low, first] = slid(T, level, place, speed, force, ones(size(force)), 1);
        [high, second] = slid(T, level, place, speed, force, -ones(size(force)), 1);
        flags = bitor(first, second);
        answer = min(max(state, low), high);
        middle = (low + high) / 2;
        new = isnan(state + 0 * middle);
        answer(new) = middle(new);
        answer(isnan(low) | isnan(high)) = NaN;
    elseif strcmp(what, 'output')
        [answer, flags] = slid(T, level, place, speed, force, stroke, 1);
    elseif strcmp(what, 'input')
        [answer, flags] = slid(T, level, place, speed, force, stroke, -1);
    elseif strcmp(what, 'compensation')
        [answer, flags] = slid(T, 'mounting_q05', place, speed, force, stroke, -1);
        answer = answer - force;
    else
        error('$function:question', 'unknown question; ask for output, input, step, compensation or levels');
    end
end

function level = level_number(T, level)
    if ischar(level)
        level = find(strcmp(T.names, level));
    end
    if numel(level) ~= 1 || level < 1 || level > numel(T.names)
        error('$function:level', 'unknown level; see $function(''levels'')');
    end
end

function [other, flags] = slid(T, level, place, speed, force, stroke, sign)
    level = level_number(T, level);
    [force, place, speed, stroke] = same_size(force, place, speed, stroke);
    flags = (place < T.place(1) | place > T.place(end)) * T.varies;
    x = min(max(place, T.place(1)), T.place(end));
    pulling = at(T.place, T.pull(level, :), x);
    returning = at(T.place, T.returning(level, :), x);
    lambda = pulling;
    lambda(stroke < 0) = returning(stroke < 0);
    s = ones(size(force));
    s(stroke < 0) = -1;
    c = T.rate(level, :);
    factor = @(v) 1 + c(1) * exp(-(v / c(2)).^2) + c(3) * abs(v);
    if T.of_rate
        lambda = lambda .* factor(speed) / factor(T.reference_speed);
    end
    if T.is_loop
        along = s .* force;
        taut = along - sign * at(T.place, T.taut_loss(level, :), x);
        direction = ones(size(force));
        direction(along > 0) = -1;
        slack = along .* exp(sign * direction .* lambda);
        if sign > 0
            other = s .* min(taut, slack);
        else
            other = s .* max(taut, slack);
        end
        other(isnan(force)) = NaN;
    else
        shift = sign * s .* lambda;
        other = force .* exp(-shift);
        if T.of_load
            p = T.load(level, 1);
            d = T.load(level, 2);
            g = to_scale(max(force, 0), p, d, T.reference_force) - shift;
            other = from_scale(g, p, d, T.reference_force);
        end
        none = ~(other > 0);
        other(none) = 0;
        flags = flags + 2 * none;
        other(isnan(force) | isnan(lambda)) = NaN;
    end
    bad = isnan(other);
    flags(bad) = 4;
end

function [output, flags, state] = crept(T, level, place, speed, force, seconds, state)
    level = level_number(T, level);
    [force, place, speed, seconds] = same_size(force, place, speed, seconds);
    flags = (place < T.place(1) | place > T.place(end)) * T.varies;
    x = min(max(place, T.place(1)), T.place(end));
    c = T.rate(level, :);
    factor = @(v) 1 + c(1) * exp(-(v / c(2)).^2) + c(3) * abs(v);
    rate = ones(size(force));
    if T.of_rate
        rate = factor(speed) / factor(T.reference_speed);
    end
    pulling = rate .* at(T.place, T.pull(level, :), x);
    returning = rate .* at(T.place, T.returning(level, :), x);
    half = (pulling + returning) / 2;
    p = T.load(level, 1);
    d = T.load(level, 2);
    x = to_scale(max(force, 0), p, d, T.reference_force) - (pulling - returning) / 2;
    k = T.presliding(level, 1) ./ rate;
    if isempty(state)
        none = zeros(size(force));
        state = struct('output', NaN(size(force)), 'friction', none, 'limit', none, 'stiffness', none);
    end
    y = to_scale(max(state.output, 0), p, d, T.reference_force);
    friction = state.friction;
    new = ~(state.output > 0);  % it begins in the middle of its friction band, or was slack and slides
    friction(new) = half(new) .* (state.output(new) <= 0);
    y(new) = x(new) - friction(new);
    state.limit(new) = half(new);
    state.stiffness(new) = k(new);
    lag = zeros(size(seconds));
    lag(seconds > 0) = T.presliding(level, 2) ./ seconds(seconds > 0);
    mean_k = (state.stiffness + k) / 2;
    u = max(mean_k .* abs(x - y - friction), 1e-3);
    limit = half + (1 ./ u - 1 ./ expm1(u)) .* (state.limit - half);  % what friction follows of it in this step
    most = min(limit, half) + 0.9 ./ (mean_k .* (1 + lag));
    friction = min(max(friction, -most), most);
    lead = x - y - friction;
    s = ones(size(lead));
    s(lead < 0) = -1;
    lead = abs(lead);
    build_up = limit - s .* friction;
    u = max(mean_k .* creep(lead, build_up .* (1 + lag), mean_k), 1e-9);
    lag = lag .* u ./ expm1(u);  % the bristles are damped by how fast they bend at the end of the step
    moved = creep(lead, build_up .* (1 + lag), mean_k);
    output = from_scale(y + s .* moved, p, d, T.reference_force);
    none = ~(force > 0) | ~(output > 0);
    output(none) = 0;
    flags = flags + 2 * none;
    bad = isnan(force) | isnan(half);
    output(bad) = NaN;
    flags(bad) = 4;
    after = s .* (limit - build_up .* exp(-mean_k .* moved));
    state.output(~bad) = output(~bad);
    state.friction(~bad) = after(~bad);
    state.limit(~bad) = half(~bad);
    state.stiffness(~bad) = k(~bad);
end

function moved = creep(change, build_up, k)
    % Solve moved + build_up (1 - exp(-k moved)) = change, by Newton's method.
    w = log(max(k .* build_up, 1e-300)) + k .* (build_up - change);
    log_w = w;
    log_w(w > 1) = log(w(w > 1));
    let_go = min(max(-k .* build_up, 0), 0.9);
    falls = 2 * k .* change ./ (sqrt((1 - let_go).^2 + 2 * let_go .* k .* change) + 1 - let_go);
    for i = 1:5
        log_w = log_w - (exp(log_w) + log_w - w) ./ (exp(log_w) + 1);
        left = let_go .* exp(-falls);
        falls = falls - (falls - let_go + left - k .* change) ./ (1 - left);
    end
    moved = min(max(change - build_up + exp(log_w) ./ k, 0), change);
    falls = falls ./ k;
    moved(build_up < 0) = falls(build_up < 0);
end

function g = to_scale(force, p, d, reference)
    y = log((force + d) / reference);
    if p < 1e-6
        g = y .* (1 + p * y / 2 .* (1 + p * y / 3));
    else
        g = expm1(p * y) / p;
    end
end

function force = from_scale(g, p, d, reference)
    if p < 1e-6
        y = g .* (1 - p * g .* (1 / 2 - p * g / 3));
    else
        y = log1p(max(p * g, 1e-9 - 1)) / p;
    end
    force = reference * exp(y) - d;
end

function y = at(places, table, x)
    places = reshape(places(:), 1, []);
    if numel(places) == 1
        y = table + 0 * x;
    else
        low = max(sum(bsxfun(@le, places(1:end - 1), x(:)), 2), 1);
        places = places(:);
        table = table(:);
        share = (x(:) - places(low)) ./ (places(low + 1) - places(low));
        y = reshape(table(low) + (table(low + 1) - table(low)) .* share, size(x));
    end
end

function varargout = same_size(varargin)
    varargout = varargin;
    n = cellfun(@numel, varargin);
    [~, largest] = max(n);
    for k = find(n == 1)
        varargout{k} = repmat(varargin{k}, size(varargin{largest}));
    end
end

function T = tables()
    T.names = {$names};
    T.place = [$place];
    T.pull = [$pull];
    T.returning = [$returning];
    T.taut_loss = [$taut_loss];
    T.load = [$load];
    T.rate = [$rate];
    T.presliding = [$presliding];
    T.is_loop = $is_loop;
    T.of_load = $of_load;
    T.of_rate = $of_rate;
    T.of_turns = $of_turns;
    T.varies = $varies;
    T.reference_force = $reference_force;
    T.reference_speed = $reference_speed;
end
