function [answer, flags] = $function(what, level, place, speed, force, stroke, state)
%$function  Forces of a fitted cable.
%
$about
%
%  output = $function('output', level, place, speed, input_force, stroke)
%     Force at the load side while the cable slides, computed from the force at the motor side.
%  input = $function('input', level, place, speed, output_force, stroke)
%     Force at the motor side that gives output_force at the load side: the inverse of 'output'.
%  output = $function('step', level, place, speed, input_force, 0, output_before)
%     Force at the load side during any motion; call it once per sample, with output_before = NaN for the first one.
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
    if strcmp(what, 'step')
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

function [other, flags] = slid(T, level, place, speed, force, stroke, sign)
    if ischar(level)
        level = find(strcmp(T.names, level));
    end
    if numel(level) ~= 1 || level < 1 || level > numel(T.names)
        error('$function:level', 'unknown level; see $function(''levels'')');
    end
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
            y = log((max(force, 0) + d) / T.reference_force);
            if p < 1e-6
                g = y .* (1 + p * y / 2 .* (1 + p * y / 3)) - shift;
                y = g .* (1 - p * g .* (1 / 2 - p * g / 3));
            else
                g = expm1(p * y) / p - shift;
                y = log1p(max(p * g, 1e-9 - 1)) / p;
            end
            other = T.reference_force * exp(y) - d;
        end
        none = ~(other > 0);
        other(none) = 0;
        flags = flags + 2 * none;
        other(isnan(force) | isnan(lambda)) = NaN;
    end
    bad = isnan(other);
    flags(bad) = 4;
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
    T.is_loop = $is_loop;
    T.of_load = $of_load;
    T.of_rate = $of_rate;
    T.varies = $varies;
    T.reference_force = $reference_force;
    T.reference_speed = $reference_speed;
end
