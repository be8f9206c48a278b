CREATE VIEW v_campaigns AS
SELECT number, id AS campaign, odd_id AS odd, title, planned, created_at,
    ROW_NUMBER() OVER (ORDER BY COALESCE((
        SELECT MAX(u.at) FROM campaign_use u WHERE u.campaign_id = campaign.id), created_at) DESC,
        COALESCE((
        SELECT MAX(u.number) FROM campaign_use u WHERE u.campaign_id = campaign.id), 0) DESC,
        number DESC) AS recency
FROM campaign
